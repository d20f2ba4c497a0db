"""Alternative texts of the pictures in the gallery, and the subjects of its thumbnails."""

from __future__ import annotations

from typing import NamedTuple


class Texts(NamedTuple):
    """The texts of one example.

    Attributes
    ----------
    subject : tuple of int
        Number of the figure, from 1, and of its axes, from 0, that the thumbnail shows.
    alt : tuple of str
        Alternative text of every figure, in the order in which they are drawn.
    share : float
        Share of the width, from the left, that the thumbnail shows. Wide rows of symbols would be too small.
    """

    subject: tuple[int, int]
    alt: tuple[str, ...]
    share: float = 1.0


TEXTS = {
    "affine_shapes": Texts(
        (3, 0),
        (
            "Four quadrilaterals A, B, C and D with the landmarks p0 to p3. In C the landmarks 0, 1 and 3 lie on a "
            "line.",
            "Left: the coordinates a and b along the closed curve, which go to infinity at C. Right: the curve in "
            "the plane of a and b, which leaves the picture at C.",
            "The curve through A, B, C and D in the unit disc. It reaches the rim at one marked point and returns "
            "at the opposite one.",
            "The same curve on a hemisphere, with its speed and acceleration, which have no jump at C.",
        ),
    ),
    "attitude": Texts(
        (1, 1),
        (
            "Four panels over twelve minutes. The body rates of Slerp jump at the pointings; the rates of the spline "
            "are smooth and zero at both ends, their derivatives are continuous, and so are the quaternions.",
        ),
    ),
    "c2_condition": Texts(
        (1, 0),
        (
            "Left: a curve on the sphere with the geodesics of the vectors in condition (13). Right: the "
            "acceleration, which jumps at the knots for Catmull–Rom and is continuous for the C² spline.",
        ),
    ),
    "camera_path": Texts(
        (1, 0),
        (
            "Left: the path of a camera from above with its viewing directions, with and without constant speed. "
            "Right: the speed, which varies between 0 and 4 m/s for equal times and is constant for times by "
            "length.",
        ),
    ),
    "covariances": Texts(
        (2, 0),
        (
            "The smaller eigenvalue and the correlation against time. Interpolated entries have a negative "
            "eigenvalue; log-Euclidean interpolation differs between grams and kilograms; the spline stays valid.",
            "A row of ellipses along the time axis, which turn and change their size smoothly between the four "
            "given covariances, with speed and acceleration below.",
        ),
        0.5,
    ),
    "crystal_orientations": Texts(
        (1, 2),
        (
            "Above: the distance from the true orientation is tens of degrees without the crystal symmetry, and "
            "below one degree with it. Below: three orientation maps; the measured one is speckled, the "
            "continuous representatives and the smoothing grid have smooth colours.",
        ),
    ),
    "date_line": Texts(
        (1, 1),
        (
            "Left: a spline of longitude and latitude crosses the whole map and oscillates at both edges. Right: "
            "the spline on the sphere passes the date line without a bend.",
        ),
    ),
    "de_casteljau": Texts(
        (1, 0),
        (
            "De Casteljau's algorithm on a sphere: three levels of geodesics between four control points lead to a "
            "point of the curve. The polynomial through the same points runs inside the sphere.",
            "A spline through four points on a sphere, with the control points on both sides of each of them.",
        ),
    ),
    "diffusion_tensors": Texts(
        (1, 0),
        (
            "Above: ellipses between two fibre bundles; interpolated entries swell in the middle, those of the "
            "spline turn. Below: the square root of the determinant, which bulges for entries and is nearly "
            "constant for the spline.",
        ),
        0.5,
    ),
    "drone_imu": Texts(
        (1, 0),
        (
            "Left: a figure of eight from above. The curve of GPS and IMU coincides with the truth, the one of GPS "
            "alone deviates. Right: the estimated biases of gyroscope and accelerometer with 95 % intervals that "
            "contain the true values.",
        ),
    ),
    "dti_volume": Texts(
        (1, 3),
        (
            "Four colour maps of fibre directions: measured, interpolated linearly, the grid spline, and the truth. "
            "Below: determinants, which are up to 2.7 times too large for linear entries, and the distribution of "
            "the errors, which are smallest for the grid spline.",
        ),
    ),
    "field_on_a_grid": Texts(
        (1, 0),
        (
            "A map of how fast the direction of the magnetic field turns, at most 0.22 degrees per year, fastest "
            "near the equator.",
        ),
    ),
    "first_curve": Texts(
        (1, 0),
        (
            "Left: a globe with four points. The spline runs on the surface; the curve of interpolated coordinates "
            "dips below it. Right: the length of the vectors, which is one for the spline and between 0.75 and "
            "1.05 for the coordinates.",
            "The spline on a globe and on a map, with its speed and its acceleration against time.",
        ),
    ),
    "fit_by_gradient_in_jax": Texts(
        (1, 0),
        (
            "Left: noisy positions with the first curve, the fitted one and the true one on a map. Right: the mean "
            "squared distance, which falls within ten steps.",
        ),
    ),
    "five_orientations": Texts(
        (3, 0),
        (
            "Degrees per unit of time: interpolated components with one flipped sign have two peaks above 800; the "
            "spline stays below 90.",
            "Frames along the time axis: five given orientations, and the spline on the unit quaternions between "
            "them, with speed and acceleration.",
            "The same frames for the spline of rotations. Its speed and acceleration are twice as large.",
        ),
        0.52,
    ),
    "imu_from_a_recording": Texts(
        (1, 1),
        (
            "Three panels over thirty seconds with a gap. Second differences of positions are noisy; angular "
            "velocity and specific force of the spline are smooth and end at the gap.",
        ),
        0.4,
    ),
    "noisy_attitude": Texts(
        (1, 1),
        (
            "Above: the angular velocity of the curve through noisy attitudes is noise of ±50 degrees per second. "
            "Below: that of the smoothing spline follows the truth within narrow bands.",
        ),
    ),
    "noisy_camera": Texts(
        (1, 0),
        (
            "Left: an oval path from above with tracked positions and viewing directions. Right: the distances of "
            "positions and attitudes from the truth are much smaller for the smoothing spline.",
        ),
    ),
    "noisy_gps": Texts(
        (1, 0),
        (
            "Left: GPS positions with the smooth track. Right: speed and course of the track with 95 % bands that "
            "contain the truth; the speed through the positions is noise up to 100 km/h.",
        ),
    ),
    "noisy_tensors": Texts(
        (1, 1),
        (
            "Above: the fractional anisotropy over a year, measured with scatter, as a moving mean, smoothed and "
            "true. Below: measured and smoothed ellipses.",
        ),
        0.5,
    ),
    "pod_over_a_parameter": Texts(
        (1, 0),
        (
            "Left: temperature profiles; the reduced model with the spline coincides with the full one, that of "
            "interpolated numbers does not. Right: entries of the basis over the diffusivity, smooth for the "
            "spline.",
        ),
    ),
    "polar_wander": Texts(
        (1, 0),
        (
            "A polar map with paleomagnetic poles and their circles of confidence, coloured by age, a smooth path "
            "with its band, the running mean and the true path.",
        ),
    ),
    "poses_over_joints": Texts(
        (2, 0),
        (
            "Errors over two joint angles: up to 7 degrees for projected matrices, up to 163 for quaternions, and "
            "0.6 for the grid spline.",
            "The figure of the grid: an orientation map with lines of equal misorientation, and the surface of the "
            "positions.",
        ),
    ),
    "qubit_control": Texts(
        (1, 0),
        (
            "A curve through six states on the Bloch sphere, with its speed and acceleration.",
            "Above: the probability of the state 0; the spline is smooth, interpolated components depend on the "
            "phases. Below: the three fields of the Hamiltonian, continuous and as pulses.",
        ),
    ),
    "reduced_bases_over_two_parameters": Texts(
        (1, 2),
        (
            "Left: a cloud at the end of the simulation, full and with two reduced models. Right: the error over the "
            "direction of the wind, ten times smaller for the grid spline than for interpolated numbers.",
        ),
    ),
    "seven_joints": Texts(
        (1, 1),
        (
            "Left: the last joint turns the long way round for a spline of numbers, and the short way on the torus. "
            "Right: the speeds of seven joints in percent of their limits.",
        ),
    ),
    "ship_with_gaps": Texts(
        (1, 0),
        (
            "A chart with reports of a ship and their courses. The curve with speed and course follows the truth "
            "through the gaps; the curve through the positions cuts corners.",
        ),
    ),
    "star_tracker_and_gyro": Texts(
        (1, 1),
        (
            "Above: a rotation angle against time; the star tracker is blind for twenty seconds. Below: the error "
            "exceeds four degrees there without the gyroscope and stays below half a degree with it.",
        ),
    ),
    "storms_from_a_table": Texts(
        (2, 0),
        (
            "The speed of the storm Larry: stairs for linear interpolation, a smooth curve in two segments for the "
            "spline.",
            "A map of the tracks of 37 Atlantic storms, coloured by their speed up to 80 km/h.",
        ),
    ),
    "tensor_volume": Texts(
        (1, 0),
        (
            "A slice of a brain phantom: fibre directions in colours, and the mean diffusivity on days 7, 30 and "
            "56. The lesion is dark at first and bright at the end; on day 30 it is interpolated.",
        ),
    ),
    "time_offset": Texts(
        (1, 1),
        (
            "Above: the rate of the gyroscope is ahead of that of the camera. Below: after shifting its times by the "
            "estimated offset of 434 ms, both agree.",
        ),
    ),
    "tracking_gap": Texts(
        (1, 0),
        (
            "Left: a path from above with a gap of twelve seconds. One curve bridges it with a wide detour; segments "
            "end at the gap. Right: the speed, which drops in the gap for the bridge.",
        ),
    ),
    "where_the_iteration_converges": Texts(
        (1, 0),
        (
            "Left: the region of condition (38) and the region where the iteration provably contracts, with dots of "
            "random walks. Right: the iteration converges for far larger distances.",
        ),
    ),
    "wind_over_a_year": Texts(
        (1, 1),
        (
            "Left: the direction of the wind over a year; a spline of degrees swings through south in December, the "
            "spline on the circle does not. Right: the same curve on a wind rose.",
        ),
    ),
}
