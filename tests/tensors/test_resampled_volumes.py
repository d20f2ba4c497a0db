"""Volumes of tensors on other voxels, in memory and from file to file."""

import dataclasses

import numpy as np
import pytest
from refused import raises
from scipy.interpolate import make_interp_spline

import symspline as ss
from symspline.tensors import Volume, read_nifti, resample, resample_nifti, write_nifti

nibabel = pytest.importorskip("nibabel")

SHAPE = (7, 6, 5)
# A scanner's oblique map, and an affine map to a standard brain.
TURN = ss.SpecialOrthogonal(3).exp(np.eye(3), [[0, -0.3, 0.2], [0.3, 0, -0.1], [-0.2, 0.1, 0]])
SCANNER = np.block([[TURN * [2.0, 2.0, 2.5], np.array([[-7.0], [11.5], [3.25]])], [np.zeros((1, 3)), 1.0]])
STANDARD = np.diag([2.2, 1.9, 2.6, 1.0]) + np.array([[0, 0.1, 0, -90], [0, 0, 0.05, -126], [0, 0, 0, -72], [0] * 4])


def logs():
    """Logarithms of eigenvalues of about 1e-3 mm²/s, smooth and noisy."""
    x, y, z = np.meshgrid(*map(np.arange, SHAPE), indexing="ij")
    smooth = np.stack([np.sin(x / 2), np.cos(y / 3) * x / 5, z / 4 - 1], axis=-1) - 7
    return smooth + 0.05 * np.random.default_rng(0).standard_normal((*SHAPE, 3))


def volume(mask=None, dtype=np.float64, affine=SCANNER):
    mask = np.ones(SHAPE, bool) if mask is None else mask
    tensors = np.einsum("ij,...j,kj->...ik", TURN, np.exp(logs()[mask]), TURN).astype(dtype)
    return Volume((tensors + tensors.swapaxes(1, 2)) / 2, mask, affine)


def flat(*positions):
    """Tensors with common eigenvectors are a flat space: a tensor-product spline of their logarithms, by SciPy."""
    values = logs()
    for axis, x in enumerate(positions):
        n = SHAPE[axis]
        values = make_interp_spline(np.arange(n), values, k=3, axis=axis)(x)
    return np.einsum("ij,...j,kj->...ik", TURN, np.exp(values), TURN)


def full(found):
    values = np.full((*found.mask.shape, 3, 3), np.nan)
    values[found.mask] = found.tensors
    return values


@pytest.mark.parametrize("block", [None, 40])
def test_tensors_with_common_eigenvectors_are_splines_of_logarithms(block, monkeypatch):
    if block is not None:
        monkeypatch.setattr("symspline.tensors._resampling._BLOCK", block)
    found = resample(volume(), zoom=(2, 1, 1.5))
    assert found.mask.shape == (13, 6, 7) and found.mask.all()
    np.testing.assert_allclose(full(found), flat(np.arange(13) / 2, np.arange(6), np.arange(7) / 1.5), rtol=1e-9)
    # The map from the new to the old voxels keeps positions.
    index = np.array([12, 5, 6, 1.0])
    np.testing.assert_allclose(found.affine @ index, SCANNER @ [6, 5, 4, 1], rtol=1e-14)


def test_voxel_size_and_zoom_agree():
    found = resample(volume(), voxel_size=(1, 2.5, 1))
    other = resample(volume(), zoom=(2, 0.8, 2.5))
    assert found.mask.shape == (13, 5, 11)
    np.testing.assert_allclose(found.tensors, other.tensors, rtol=1e-12)
    np.testing.assert_allclose(found.affine, other.affine, rtol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(found.affine[:3, :3], axis=0), [1, 2.5, 1])


def test_voxels_are_in_the_mask_if_they_are_between_voxels_of_the_mask():
    mask = np.ones(SHAPE, bool)
    mask[3, 2, 1] = mask[:, 0] = False
    mask[0, 5, 4] = False
    given = volume(mask)
    found = resample(given, zoom=2)
    assert not found.mask[6, 4, 2] and not found.mask[5, 4, 2] and not found.mask[:, :2].any()
    assert found.mask[::2, ::2, ::2].sum() == mask.sum()
    np.testing.assert_allclose(full(found)[::2, ::2, ::2][mask], given.tensors, rtol=1e-11)
    assert np.isfinite(found.tensors).all() and np.linalg.eigvalsh(found.tensors).min() > 0


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_precision_and_header_are_kept(dtype):
    header = nibabel.Nifti1Header()
    found = resample(dataclasses.replace(volume(dtype=dtype), header=header), zoom=2)
    assert found.tensors.dtype == dtype and found.header is header


def test_like_another_volume(tmp_path):
    given = volume()
    # Starts at voxel (1, 0.5, -1) and ends beyond the last slice.
    step = np.array([[0.5, 0, 0, 1], [0, 1, 0, 0.5], [0, 0, 2, -1], [0, 0, 0, 1]])
    target = Volume(np.empty((0, 3, 3)), np.zeros((11, 5, 4), bool), SCANNER @ step)
    found = resample(given, like=target)
    assert np.array_equal(found.affine, target.affine) and found.mask.shape == (11, 5, 4)
    assert found.mask[:, :, 1:3].all() and not found.mask[:, :, [0, 3]].any()
    expected = flat(1 + 0.5 * np.arange(11), 0.5 + np.arange(5), [1, 3])
    np.testing.assert_allclose(full(found)[:, :, 1:3], expected, rtol=1e-9)
    image = nibabel.Nifti1Image(np.zeros((11, 5, 4), np.float32), SCANNER @ step)
    nibabel.save(image, tmp_path / "like.nii.gz")
    for other in (image, tmp_path / "like.nii.gz"):
        # The file has the map in single precision.
        np.testing.assert_allclose(resample(given, like=other).tensors, found.tensors, rtol=1e-5)
    small = resample(given, like=dataclasses.replace(target, mask=np.zeros((3, 3, 1), bool)))
    assert not small.mask.any() and small.tensors.shape == (0, 3, 3)


def test_slices_and_lines_of_voxels():
    mask = np.zeros(SHAPE, bool)
    mask[:, :, 2] = True
    plane = Volume(volume(mask).tensors, np.ones((7, 6, 1), bool), np.eye(4))
    found = resample(plane, voxel_size=0.5)
    assert found.mask.shape == (13, 11, 1) and np.array_equal(found.affine, np.diag([0.5, 0.5, 1, 1]))
    expected = flat(np.arange(13) / 2, np.arange(11) / 2, np.arange(5))[:, :, 2:3]
    np.testing.assert_allclose(full(found), expected, rtol=1e-9)
    mixed = resample(plane, voxel_size=0.5, bc_type=("natural", "clamped", "not-a-knot"))
    middle = np.arange(13) / 2, np.arange(11) / 2
    nodes = plane.tensors.reshape(7, 6, 3, 3)
    grid = ss.GridSpline((None, None), nodes, "spd:3", bc_type=("natural", "clamped"))
    np.testing.assert_allclose(full(mixed)[:, :, 0], grid.grid(*middle), rtol=1e-12)
    single = Volume(plane.tensors[:1], np.ones((1, 1, 1), bool), np.eye(4))
    assert np.array_equal(resample(single, zoom=3).tensors, single.tensors)


def test_progress_ends_with_all_voxels(monkeypatch):
    monkeypatch.setattr("symspline.tensors._resampling._BLOCK", 100)
    seen = []
    resample(volume(), zoom=2, progress=lambda *own: seen.append(own))
    assert seen == sorted(seen) and len(seen) > 3 and seen[-1] == (13 * 11 * 9,) * 2


# ---- files ----


def source(path, *, qform=1, sform=4, kind=nibabel.Nifti1Image, itk=False):
    """A file with all that headers have: units, codes, two maps, times, texts, and an extension."""
    mask = np.ones(SHAPE, bool)
    mask[0], mask[4, 3, 2] = False, False
    write_nifti(path, volume(mask, np.float32), order="itk" if itk else "fsl")
    numbers = np.asanyarray(nibabel.load(path).dataobj).copy()
    image = kind(numbers, None, nibabel.load(path).header)
    image.set_qform(SCANNER, qform)
    image.set_sform(STANDARD, sform)
    header = image.header
    header.set_xyzt_units("mm", "sec")
    header["descrip"], header["toffset"], header["slice_code"], header["slice_duration"] = b"FA 2.5", 3.5, 3, 0.1
    header["cal_max"], header["intent_name"] = 0.003, b"tensor"
    header.extensions.append(nibabel.nifti1.Nifti1Extension("comment", b"of one subject"))
    nibabel.save(image, path)
    return header


@pytest.mark.parametrize("codes", [(1, 4), (2, 0), (0, 2), (0, 0)])
def test_headers_survive_and_both_maps_lead_to_the_same_positions(codes, tmp_path):
    qform, sform = codes
    old = source(tmp_path / "old.nii.gz", qform=qform, sform=sform)
    old = nibabel.load(tmp_path / "old.nii.gz").header
    resample_nifti(tmp_path / "old.nii.gz", tmp_path / "new.nii.gz", order="fsl", zoom=2)
    image = nibabel.load(tmp_path / "new.nii.gz")
    new = image.header
    assert image.shape == (13, 11, 9, 6) and new.get_data_dtype() == np.float32
    assert new.get_xyzt_units() == ("mm", "sec")
    for name in ("descrip", "toffset", "cal_max", "intent_name", "intent_code"):
        assert new[name] == old[name]
    assert [own.get_content() for own in new.extensions] == [own.get_content() for own in old.extensions] != []
    assert int(new["slice_code"]) == 0 and float(new["slice_duration"]) == 0
    if any(codes):
        assert (int(new["qform_code"]), int(new["sform_code"])) == codes
    ends = np.array([[0, 0, 0, 1], [12, 10, 8, 1], [5, 2, 8, 1]])
    halves = ends * [0.5, 0.5, 0.5, 1]
    for name, code in (("qform", qform), ("sform", sform)):
        if code:
            maps = [getattr(header, f"get_{name}")() for header in (old, new)]
            np.testing.assert_allclose(ends @ maps[1].T, halves @ maps[0].T, atol=1e-4)
    np.testing.assert_allclose(ends @ image.affine.T, halves @ old.get_best_affine().T, atol=1e-4)
    np.testing.assert_allclose(new.get_zooms()[:3], np.divide(old.get_zooms()[:3], 2), rtol=1e-4)
    numbers = np.asanyarray(image.dataobj).copy()
    assert np.isfinite(numbers).all() and not numbers[:2].any() and not numbers[8, 6, 4].any()
    assert read_nifti(tmp_path / "new.nii.gz", order="fsl").mask.sum() == numbers.any(axis=-1).sum()


@pytest.mark.parametrize("kind", [nibabel.Nifti1Image, nibabel.Nifti2Image])
def test_order_and_format_are_those_of_the_source(kind, tmp_path, caplog):
    source(tmp_path / "old.nii", kind=kind, itk=True)
    caplog.clear()
    resample_nifti(tmp_path / "old.nii", tmp_path / "new.nii", voxel_size=2)
    image = nibabel.load(tmp_path / "new.nii")
    assert type(image) is kind and image.shape[3:] == (1, 6) and int(image.header["intent_code"]) == 1005
    assert not caplog.records


def test_headers_of_another_file(tmp_path):
    source(tmp_path / "old.nii")
    given = volume()
    for like in (
        tmp_path / "old.nii",
        nibabel.load(tmp_path / "old.nii"),
        read_nifti(tmp_path / "old.nii", order="fsl"),
    ):
        write_nifti(tmp_path / "new.nii", dataclasses.replace(given, affine=STANDARD), order="fsl", like=like)
        header = nibabel.load(tmp_path / "new.nii").header
        assert header["descrip"].item() == b"FA 2.5" and int(header["sform_code"]) == 4
        # The shape is the same, and so is the timing of slices.
        assert int(header["slice_code"]) == 3
    with pytest.raises(TypeError, match="like must be a path, a NIfTI image of nibabel or a Volume, not 3"):
        write_nifti(tmp_path / "new.nii", given, order="fsl", like=3)


def test_new_files_are_in_millimetres(tmp_path):
    write_nifti(tmp_path / "new.nii", volume(), order="fsl")
    assert nibabel.load(tmp_path / "new.nii").header.get_xyzt_units()[0] == "mm"


@pytest.mark.parametrize(
    "match, options",
    [
        ("exactly one of zoom, voxel_size and like must be given, not none", {}),
        ("must be given, not zoom and voxel_size", {"zoom": 2, "voxel_size": 1}),
        ("zoom must be one or three positive numbers, not 0", {"zoom": 0}),
        (r"voxel_size must be one or three positive numbers, not \[1, 2\]", {"voxel_size": [1, 2]}),
        ("zoom must be one or three positive numbers, not nan", {"zoom": np.nan}),
        ("the axes of like are not those of the volume", {"like": volume(affine=STANDARD)}),
        ("the axes of like are not", {"like": volume(affine=SCANNER @ np.diag([1, -1, 1, 1]))}),
    ],
)
def test_invalid_voxels_raise(match, options):
    raises(match, resample, volume(), **options)


def test_masks_without_voxels_or_with_others_raise():
    empty = Volume(np.empty((0, 3, 3)), np.zeros(SHAPE, bool), np.eye(4))
    raises("the mask of the volume is empty", resample, empty, zoom=2)
    wrong = dataclasses.replace(volume(), mask=np.zeros(SHAPE, bool))
    raises("but the mask has 0 voxels", resample, wrong, zoom=2)


def test_tensors_that_are_not_positive_definite_are_named():
    given = volume()
    given.tensors[40] = np.diag([1e-3, 4e-4, -4e-5])
    given.tensors[77, 0, 0] = -1
    voxel = r"\(1, 2, 0\)"
    raises(f"2 of 210 tensors are not positive definite; the first is that of voxel {voxel}", resample, given, zoom=2)


def test_other_formats_raise(tmp_path):
    nibabel.save(nibabel.MGHImage(np.zeros((4, 3, 2, 6), np.float32), np.eye(4)), tmp_path / "a.mgz")
    raises("this is not a NIfTI file", read_nifti, tmp_path / "a.mgz", order="fsl")
