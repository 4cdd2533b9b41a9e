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


def revolved(profile: list[tuple[float, float]], sides: int) -> meshio.Mesh:
    """A surface of revolution with this many sides.

    The profile lists radii and heights (mm), from the bottom to the rim.
    """
    angles = 2.0 * np.pi * np.arange(sides) / sides
    points = []
    for radius, height in profile:
        for angle in angles:
            points.append([radius * np.cos(angle), radius * np.sin(angle), height])
    rings = np.arange(len(points)).reshape(len(profile), sides)
    next_points = np.roll(rings, -1, axis=1)
    quads = np.stack([rings[:-1], next_points[:-1], next_points[1:], rings[1:]], axis=-1)
    return meshio.Mesh(points, [("quad", quads.reshape(-1, 4))])


# %%
# A funnel has six sides and is closed at the bottom of its neck. The files of meshes have no units:
# ``scale`` is the length of their unit.

Path("runs").mkdir(exist_ok=True)
funnel = revolved([(0.0, 0.0), (1.5, 0.0), (1.5, 2.0), (4.5, 7.0)], sides=6)
funnel.write("runs/funnel.obj")
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
# A bead that slides in a round bowl without friction rises as high on the other side. It gets there
# after half the period, π √((B - R)/g), and 0.6 % more for its swing of 0.3 rad. In a bowl of
# facets, the bead hits the next facet at each edge.

BOWL = 5.0  # radius of the bowl, mm
BEAD = 0.3  # radius of the bead, mm
SWING = 0.3  # rad
half_period = np.pi * np.sqrt(1e-3 * (BOWL - BEAD) / 9.81) * (1.0 + SWING**2 / 16.0)


def write_bowl(rings: int) -> None:
    """Write the mesh of a bowl with this many rings of facets from the bottom to the rim."""
    profile = []
    for angle in np.linspace(0.0, np.pi / 2.0, rings + 1):
        profile.append((BOWL * np.sin(angle), BOWL * (1.0 - np.cos(angle))))
    revolved(profile, sides=4 * rings).write("runs/bowl.obj")


def sliding_bead(rings: int) -> dict[str, object]:
    """The case of a bead that starts to slide down this bowl, without touching a facet."""
    distance = BOWL * np.cos(np.pi / 4.0 / rings) ** 2 - BEAD - 0.01
    x = distance * np.sin(SWING)
    z = BOWL - distance * np.cos(SWING)
    return {
        "boundary": {"mesh": "runs/bowl.obj", "scale": "1 mm", "material": "polystyrene"},
        "placed": [{"radius": f"{BEAD} mm", "at": [f"{x} mm", "0 mm", f"{z} mm"]}],
        "beads": {"material": "glass"},
        "liquid": {"surface_tension": "1 uN/m", "dynamic_viscosity": "0 Pa*s"},
        "contact": {"friction": {"bead_bead": 0.0, "bead_wall": 0.0}, "rolling_friction": 0.0},
        "drive": {"frequency": "100 Hz", "peak_acceleration": "0 g"},
        "run": {"duration": "0.09 s", "longest_settling": "0 s", "samples_per_cycle": 20},
    }


facets = []
distances = []
times = []
for rings in (3, 6, 12):
    write_bowl(rings)
    motion = walkers.run(sliding_bead(rings)).motion
    x = motion.position[:, 0, 0]
    turning_point = x.argmin()
    facets.append(len(motion.case.boundary.walls))
    distances.append(-x[turning_point] / x[0])
    times.append(motion.time[turning_point] / half_period)
    print(f"{facets[-1]} parts: {distances[-1]:.2f} of the distance in {times[-1]:.2f} of the time")

figure, axes = plt.subplots(figsize=(7, 4))
axes.semilogx(facets, distances, "o-", label="distance on the other side")
axes.semilogx(facets, times, "s-", label="time to get there")
axes.axhline(1.0, color="0.5", lw=0.8)
axes.set_xticks(facets, facets)
axes.minorticks_off()
axes.set(xlabel="faces, edges and corners of the bowl", ylabel="over that of a round bowl")
axes.legend()
plt.show()
