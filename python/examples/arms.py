# SPDX-License-Identifier: Apache-2.0
"""Both arms at home and in random configurations, rigid beside compliant.

    PYTHONPATH=build/release/python python3 python/examples/arms.py [FIGURE.png]"""
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

import tandem  # noqa: E402

robot = tandem.Robot.load("ark2024")
figure = plt.figure(figsize=(10, 6), layout="constrained")
for place, model in enumerate(("rigid", "compliant")):
    axis = figure.add_subplot(1, 2, place + 1, projection="3d")
    for name, colour in zip(robot.arms, ("tab:blue", "tab:orange")):
        arm = robot.arm(name, model=model)
        for q in (arm.home, *arm.sample(6, seed=2)):
            x, y, z = 1e3 * arm.shape(q, 80).T
            axis.plot(x, y, z, color=colour, alpha=1.0 if q is arm.home else 0.6)
    axis.set(title=model, xlabel="x, mm", ylabel="y, mm", zlabel="z, mm")
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "arms.png", dpi=150)
