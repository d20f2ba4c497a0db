"""The attitude of a spacecraft between four pointings, from SciPy's rotations: draws attitude.png."""

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import symspline as ss

minutes = [0, 4, 9, 12]
pointings = Rotation.from_euler("ZYX", [[0, 0, 0], [80, 30, 0], [200, -20, 45], [300, 0, 0]], degrees=True)
attitude = ss.CubicSpline(minutes, pointings, "so:3", bc_type="clamped")  # at rest before and after

x = np.linspace(0, 12, 500)
figure = Figure(figsize=(9, 7), layout="constrained")
quaternion, rate, torque = figure.subplots(3, sharex=True)
quaternion.plot(x, ss.rotations.quaternion(attitude, x, scalar_first=True), label=list("wxyz"))
rate.plot(x, np.degrees(ss.rotations.angular_velocity(attitude, x)), label=list("xyz"))
torque.plot(x, np.degrees(ss.rotations.angular_acceleration(attitude, x)), label=list("xyz"))
quaternion.set(ylabel="quaternion", title="A slew through four pointings, at rest at both ends")
rate.set(ylabel="rate in the body\ndegrees/min")
torque.set(ylabel="its derivative\ndegrees/min²", xlabel="minutes")
for axes in (quaternion, rate, torque):
    axes.set_xticks(minutes)
    axes.grid(axis="x")
    axes.legend(loc="center left", bbox_to_anchor=(1, 0.5))
figure.savefig("attitude.png")

pointing = ss.rotations.rotation(attitude, 6.5)  # a Rotation of SciPy again
print("at 6.5 minutes:", pointing.as_euler("ZYX", degrees=True).round(2))
