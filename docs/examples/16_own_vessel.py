"""
A vessel of your own
====================

Pour wet beads into a funnel that is given as a mesh, and see how many facets make a bowl round.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import meshio
import numpy as np

import walkers


def turned(profile: list[tuple[float, float]], sides: int) -> meshio.Mesh:
    """A surface of revolution with this many sides, of radii and heights (mm) from the bottom to the rim."""
    angles = 2.0 * np.pi * np.arange(sides) / sides
    points = [
        [radius * np.cos(at), radius * np.sin(at), z] for radius, z in profile for at in angles
    ]
    rings = np.arange(len(points)).reshape(len(profile), sides)
    quads = np.stack(
        [rings[:-1], np.roll(rings[:-1], -1, 1), np.roll(rings[1:], -1, 1), rings[1:]], axis=-1
    )
    return meshio.Mesh(points, [("quad", quads.reshape(-1, 4))])


# %%
# A funnel with six sides, closed at the bottom of its neck. Files have no units: ``scale`` is the length of theirs.

Path("runs").mkdir(exist_ok=True)
turned([(0.0, 0.0), (1.5, 0.0), (1.5, 2.0), (4.5, 7.0)], sides=6).write("runs/funnel.obj")
case = {
    "boundary": {"mesh": "runs/funnel.obj", "scale": "1 mm", "material": "polystyrene"},
    "mixture": {"small": ["0.3 mm", "0.315 mm"], "large": ["0.5 mm", "0.59 mm"], "count": 40},
    "beads": {"material": "glass"},
    "liquid": {"name": "water", "volume_fraction": 0.01},
    "contact": {"friction": {"bead_bead": 0.3, "bead_wall": 0.3}, "rolling_friction": 0.0},
    "drive": {"frequency": "100 Hz", "peak_acceleration": "4 g"},
    "run": {"duration": "0.1 s"},
}
run = walkers.run(case)
run.render("runs/funnel.png")

# %%
# A bowl of facets. A bead that slides in a round bowl without friction comes as high on the other side, after half the
# period 2π √((B - R)/g) (and 0.6 % for its swing of 0.3 rad). At each edge between facets it hits the next one.

bowl, radius, swing = 5.0, 0.3, 0.3  # mm, mm, rad
rounds = np.pi * np.sqrt(1e-3 * (bowl - radius) / 9.81) * (1.0 + swing**2 / 16.0)
facets, heights, times = [], [], []
for rings in (3, 6, 12):
    bends = np.linspace(0.0, np.pi / 2.0, rings + 1)
    turned([(bowl * np.sin(at), bowl * (1.0 - np.cos(at))) for at in bends], 4 * rings).write(
        "runs/bowl.obj"
    )
    out = bowl * np.cos(np.pi / 4.0 / rings) ** 2 - radius - 0.01  # so that it touches no facet
    case |= {
        "mixture": None,
        "boundary": {**case["boundary"], "mesh": "runs/bowl.obj"},
        "placed": [
            {
                "radius": "0.3 mm",
                "at": [f"{out * np.sin(swing)} mm", "0 mm", f"{bowl - out * np.cos(swing)} mm"],
            }
        ],
        "liquid": {"surface_tension": "1 uN/m", "dynamic_viscosity": "0 Pa*s"},
        "contact": {"friction": {"bead_bead": 0.0, "bead_wall": 0.0}, "rolling_friction": 0.0},
        "drive": {"frequency": "100 Hz", "peak_acceleration": "0 g"},
        "run": {"duration": "0.09 s", "longest_settling": "0 s", "samples_per_cycle": 20},
    }
    motion = walkers.run({key: table for key, table in case.items() if table}).motion
    across = motion.position[:, 0, 0]
    facets.append(len(motion.case.boundary.walls))
    heights.append(-across.min() / across[0])
    times.append(motion.time[across.argmin()] / rounds)
    print(
        f"{facets[-1]} parts: back to {heights[-1]:.2f} of its distance, in {times[-1]:.2f} of the time"
    )

figure, axes = plt.subplots(figsize=(7, 4))
axes.semilogx(facets, heights, "o-", label="distance on the other side")
axes.semilogx(facets, times, "s-", label="time to get there")
axes.axhline(1.0, color="0.5", lw=0.8)
axes.set(xlabel="faces, edges and corners of the bowl", ylabel="over that of a round bowl")
axes.legend()
plt.show()
