"""Volumes of tensors in NIfTI files."""

import dataclasses
import sys

import numpy as np
import pytest
from refused import raises

import symspline as ss
from symspline.tensors import Volume, read_nifti, to_vectors, write_nifti

nibabel = pytest.importorskip("nibabel")

AFFINE = np.diag([2.0, 2.0, 2.5, 1.0])


def volume(dtype=np.float32):
    mask = np.zeros((4, 3, 2), bool)
    mask[1:3, 1:, 0] = True
    tensors = ss.SymmetricPositiveDefinite(3).random_point(np.random.default_rng(0), 4).astype(dtype)
    return Volume((tensors + tensors.swapaxes(1, 2)) / 2, mask, AFFINE)


def raw(name):
    image = nibabel.load(name)
    return image, np.asanyarray(image.dataobj)


@pytest.mark.parametrize("order", ["dipy", "fsl", "mrtrix", "itk"])
def test_there_and_back(order, tmp_path):
    name, given = str(tmp_path / "tensors.nii.gz"), volume()
    write_nifti(name, given, order=order)
    back = read_nifti(name, order=None if order == "itk" else order)
    assert np.array_equal(back.tensors, given.tensors) and back.tensors.dtype == np.float32
    assert np.array_equal(back.mask, given.mask) and np.array_equal(back.affine, AFFINE)
    image, numbers = raw(name)
    assert int(image.header["intent_code"]) == (1005 if order == "itk" else 0)
    # nifti1.h: intent_p1 is the number of rows.
    assert image.header["intent_p1"] == (3 if order == "itk" else 0)
    # ITK's files hold the lower triangle row by row, along the fifth axis.
    assert numbers.shape == ((4, 3, 2, 1, 6) if order == "itk" else (4, 3, 2, 6))
    expected = to_vectors(given.tensors, order="dipy" if order == "itk" else order)
    assert np.array_equal(numbers.reshape(4, 3, 2, 6)[given.mask], expected)
    assert not numbers.reshape(4, 3, 2, 6)[~given.mask].any()


def test_masks(tmp_path):
    name, given = str(tmp_path / "tensors.nii"), volume()
    write_nifti(name, given, order="fsl")
    some = given.mask.copy()
    some[1] = False
    nibabel.save(nibabel.Nifti1Image(some.astype(np.uint8), AFFINE), str(tmp_path / "mask.nii"))
    for mask in (some, some.astype(int).tolist(), str(tmp_path / "mask.nii")):
        picked = read_nifti(name, order="fsl", mask=mask)
        assert np.array_equal(picked.mask, some) and np.array_equal(picked.tensors, given.tensors[2:])
    _, numbers = raw(name)
    numbers = np.array(numbers)
    numbers[1, 1, 0, 3] = np.nan
    nibabel.save(nibabel.Nifti1Image(numbers, AFFINE), name)
    assert np.array_equal(read_nifti(name, order="fsl").tensors, given.tensors[1:])


def test_tensors_along_the_axes_are_inside(tmp_path):
    """Three of their six numbers are 0."""
    name, given = str(tmp_path / "tensors.nii"), volume()
    write_nifti(name, Volume(np.stack([np.diag([1.0, 2, 3])] * 4), given.mask, AFFINE), order="fsl")
    assert np.array_equal(read_nifti(name, order="fsl").mask, given.mask)


def test_invalid_volumes_raise(tmp_path):
    name, given = str(tmp_path / "tensors.nii"), volume()
    write_nifti(name, given, order="fsl")
    full = Volume(given.tensors, np.ones_like(given.mask), AFFINE)
    for match, call in [
        ("does not state the order of its six volumes", lambda: read_nifti(name)),
        (
            r"mask has shape \(4, 3\), but the volume \(4, 3, 2\)",
            lambda: read_nifti(name, order="fsl", mask=np.ones((4, 3))),
        ),
        (r"the mask has 24 voxels, which need shape \(24, 3, 3\)", lambda: write_nifti(name, full, order="fsl")),
        ("order must be", lambda: write_nifti(name, given, order="ants")),
    ]:
        raises(match, call)
    nibabel.save(nibabel.Nifti1Image(np.zeros((4, 3, 2, 7), np.float32), AFFINE), name)
    raises(r"has shape \(4, 3, 2, 7\), but tensors need", read_nifti, name, order="fsl")


def test_masks_that_are_none(tmp_path):
    name, given = str(tmp_path / "tensors.nii"), volume()
    write_nifti(name, given, order="fsl")
    for value in (np.nan, -1.0):
        mask = np.where(given.mask, 1.0, value)
        raises(rf"mask\[0, 0, 0\] is {value}; it must be 0 or more", read_nifti, name, order="fsl", mask=mask)
    turned = nibabel.Nifti1Image(given.mask.astype(np.uint8), np.diag([-1.0, 1, 1, 1]) @ AFFINE)
    nibabel.save(turned, str(tmp_path / "mask.nii"))
    with pytest.raises(ss.ValidationError, match=r"mask\.nii has another affine map than the tensors"):
        read_nifti(name, order="fsl", mask=str(tmp_path / "mask.nii"))


def test_an_order_that_is_not_the_files(tmp_path):
    name = str(tmp_path / "tensors.nii")
    write_nifti(name, volume(), order="itk")
    raises("in the order of NIfTI, not in that of 'fsl'; omit order", read_nifti, name, order="fsl")
    for order in (None, "dipy", "itk"):
        assert np.array_equal(read_nifti(name, order=order).tensors, volume().tensors)


def test_without_nibabel(monkeypatch):
    monkeypatch.setitem(sys.modules, "nibabel", None)
    raises("pip install nibabel", read_nifti, "tensors.nii", error=ImportError, order="fsl")


@pytest.mark.parametrize("order", ["fsl", "itk"])
def test_the_header_of_the_volume_that_was_read_is_kept(order, tmp_path):
    first, second = str(tmp_path / "first.nii.gz"), str(tmp_path / "second.nii.gz")
    given = volume(np.float64)
    numbers = np.zeros((4, 3, 2, 1, 6), np.float32)
    numbers[given.mask, 0] = to_vectors(given.tensors, order="dipy")
    image = nibabel.Nifti1Image(numbers, AFFINE)
    image.header.set_xyzt_units("mm", "sec")
    image.header["descrip"] = b"tensors of one subject"
    image.header["intent_code"], image.header["intent_p1"] = 1005, 3
    image.set_qform(AFFINE, 1)
    image.set_sform(AFFINE, 4)
    nibabel.save(image, first)
    read = read_nifti(first)
    write_nifti(second, dataclasses.replace(read, tensors=read.tensors.astype(float) + np.eye(3) / 3), order=order)
    header = nibabel.load(second).header
    assert header.get_xyzt_units() == ("mm", "sec") and header["descrip"].item() == b"tensors of one subject"
    assert (int(header["qform_code"]), int(header["sform_code"])) == (1, 4)
    assert int(header["intent_code"]) == (1005 if order == "itk" else 0)
    # Numbers are not rounded to the type of the first file.
    back = read_nifti(second, order=order)
    assert np.array_equal(back.tensors, read.tensors.astype(float) + np.eye(3) / 3)
