"""The beads of a run in three dimensions, to be played and turned: one K3D scene for reports and for notebooks.

Seen in the frame of the boundary, in mm. Beads are beach balls, which shows how they roll, but for those whose spins
are recorded too seldom to be added up (`walkers.postprocess.rolling`).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Motion, gathered, read_motion
from walkers.postprocess.paraview import boundary_of
from walkers.postprocess.rolling import turns_of
from walkers.postprocess.scene import (
    GLASS,
    RUBY,
    Camera,
    against_gravity,
    axes_toward,
    beach_ball,
    pointed_out,
    round_below,
)

if TYPE_CHECKING:
    import k3d


MOST_PLACES = 8000
"""Beads times instants of a scene, for the size of its file."""
_FEWEST_INSTANTS = 150
"""Before instants are left out beyond this, walkers are."""
_WHITE, _FLOOR, _RULE = "#f6efe9", "#dfe5e8", "#9aa6ae"
_ROUNDS = 24
"""Cells around a ball."""
_MARGIN = 1.15
"""Extent of the view over that of the beads."""
_GRID = 2.0**-13
"""mm, to which places are rounded: 0.1 µm. What is rounded to powers of two can be packed."""
_LANE = 1.25
"""Lengths of a walker between the lanes of independent ones."""
_VIEW = 30.0
"""Degrees, of the camera's view."""
_ASPECT = 1.5
"""Width of a picture over its height, at least."""


@dataclass(frozen=True)
class Scene:
    """A K3D plot and what is to be said beside it.

    Attributes
    ----------
    plot
        The plot; a widget in a notebook.
    begin, end
        Time of the first and the last instant, s.
    cameras
        Where one may look from, by name: place, target and upward direction of a camera, mm.
    captions
        Of what is shown and what is left out.
    """

    plot: k3d.Plot
    begin: float
    end: float
    cameras: dict[str, list[float]]
    captions: tuple[str, ...]


def scene_of(run: str | Path | Motion, *, places: int = MOST_PLACES, height: int = 480) -> Scene:
    """The scene of a run.

    Parameters
    ----------
    run
        A run directory, or the motion in it.
    places
        Beads times instants at most; instants, and walkers of many, are left out evenly.
    height
        Of the plot, pixels.
    """
    import k3d

    read = run if isinstance(run, Motion) else read_motion(run)
    whole = gathered(read, lane=_LANE).driven
    motion, frames, beads, captions = _thinned(whole, places)
    if len(whole.walkers) < len(read.walkers):
        captions.append(f"The first of {len(read.walkers)} walkers is shown.")
    plot = k3d.plot(
        height=height,
        name=whole.case.name,
        grid_visible=False,
        fps=30.0,
        camera_fov=_VIEW,
        axes=["x", "y", "z"],
        background_color=0xFFFFFF,
    )
    plot.fps_meter = False
    for wall in _walls(motion):
        plot += wall
    pointed, turns = pointed_out(whole), turns_of(whole)
    chosen = np.isin(np.arange(len(whole.radius)), [bead for frame in frames for bead in pointed(int(frame))])
    colours = np.where(chosen, np.where(whole.large, *RUBY), np.where(whole.large, *GLASS))
    packed = np.array([int(str(name)[1:], 16) for name in colours], dtype=np.uint32)
    if turns is None:
        plot += _points(motion, packed[beads])
        captions.append("Beads do not show how they roll: their frames are too far apart for it.")
    else:
        for ball in _balls(motion, turns.turned[frames][:, beads], packed[beads]):
            plot += ball
    plot.camera_auto_fit = False
    cameras = cameras_of(motion)
    plot.camera = cameras["as at first"]
    # Plays the run in so many seconds in K3D's own player, which goes by its time speed.
    plot.time = float(motion.time[0])
    plot.time_speed = float(motion.time[-1] - motion.time[0]) / 12.0 or 1.0
    return Scene(plot, float(motion.time[0]), float(motion.time[-1]), cameras, tuple(captions))


def _thinned(motion: Motion, places: int) -> tuple[Motion, npt.NDArray[np.int64], npt.NDArray[np.bool_], list[str]]:
    """The motion of fewer walkers at fewer instants, these instants and beads, and what is left out in words."""
    captions = []
    beads = np.ones(len(motion.radius), dtype=bool)
    walkers, count = motion.walkers, len(motion.walkers)
    if motion.case.apart and count > 2 and len(motion.time) * len(beads) > places:
        per_walker = len(beads) / count
        instants = min(len(motion.time), _FEWEST_INSTANTS)
        shown = min(count, max(2, int(places / (instants * per_walker))))
        if shown < count:
            chosen = np.unique(np.linspace(0, count - 1, shown).round().astype(int))
            walkers = tuple(walkers[number] for number in chosen)
            beads = np.isin(motion.walker_of, [walker.walker for walker in walkers])
            captions.append(f"{len(walkers)} of {count} walkers are shown.")
    stride = max(1, ceil(len(motion.time) * int(beads.sum()) / places))
    samples = motion.case.run.samples_per_cycle
    # Of a divisor of the samples in a cycle, or of whole cycles, the phases are the same in each cycle.
    divisors = [number for number in range(stride, samples + 1) if samples % number == 0]
    stride = divisors[0] if divisors else ceil(stride / samples) * samples
    frames = np.arange(0, len(motion.time), stride)
    if stride > 1:
        often = f"{samples // stride} instants a cycle" if stride < samples else f"every {stride // samples}th cycle"
        captions.append(f"{often.capitalize()} {'are' if stride < samples else 'is'} shown, with what is between them.")
    part = motion.select(slice(None, None, stride), None if beads.all() else np.flatnonzero(beads))
    return part, frames, beads, captions


def _balls(motion: Motion, turned: FloatArray, colours: npt.NDArray[np.uint32]) -> list[Any]:
    """A ball a bead, its matrix a series in time, between whose instants K3D turns it on."""
    import k3d
    from scipy.spatial.transform import Rotation

    vertices, indices, white = beach_ball(_ROUNDS)
    times = [f"{time:.6f}" for time in motion.time]
    balls = []
    for bead, radius in enumerate(motion.radius * 1e3):
        matrices = np.zeros((len(times), 4, 4), dtype=np.float32)
        matrices[:, :3, :3] = np.round(Rotation.from_quat(turned[:, bead]).as_matrix() * radius / _GRID) * _GRID
        matrices[:, :3, 3] = np.round(motion.position[:, bead] * 1e3 / _GRID) * _GRID
        matrices[:, 3, 3] = 1.0
        ball = k3d.mesh(
            vertices,
            indices.astype(np.uint32),
            normals=vertices,
            colors=np.where(white, _packed(_WHITE), colours[bead]).astype(np.uint32),
            flat_shading=False,
            roughness=0.6,
            name=f"bead {bead}",
        )
        ball.model_matrix = dict(zip(times, matrices, strict=True))
        balls.append(ball)
    return balls


def _points(motion: Motion, colours: npt.NDArray[np.uint32]) -> Any:
    """All beads as points with a size."""
    import k3d

    points = k3d.points(
        np.zeros((len(motion.radius), 3), dtype=np.float32),
        point_sizes=(2e3 * motion.radius).astype(np.float32),
        colors=colours,
        shader="3d",
        roughness=0.5,
        name="beads",
    )
    places = (np.round(motion.position * 1e3 / 2.0**-10) * 2.0**-10).astype(np.float32)
    points.positions = {f"{time:.6f}": place for time, place in zip(motion.time, places, strict=True)}
    return points


def _walls(motion: Motion) -> list[Any]:
    """The boundary, transparent where it is upright, and lines on a floor that say how far beads go."""
    import k3d

    faces = boundary_of(motion)
    corners = np.asarray(faces.points, dtype=np.float32) * 1e3
    low, high = corners.min(axis=0), corners.max(axis=0)
    walls = []
    for cell in faces.irregular_faces:
        polygon = corners[cell]
        fan = np.array([(0, one, one + 1) for one in range(1, len(polygon) - 1)], dtype=np.uint32)
        level = bool(np.ptp(polygon[:, 2]) < 1e-6)
        # A hair below the beads that touch it.
        wall = k3d.mesh(
            polygon - np.float32(2e-3) * np.array([0, 0, level], dtype=np.float32),
            fan,
            color=_packed(_FLOOR),
            side="double",
            opacity=1.0 if level else 0.12,
            roughness=1.0,
            name="floor" if level else "wall",
        )
        walls.append(wall)
    if len(walls) == 1:
        walls.append(_rules(low, high))
    return walls


def _rules(low: FloatArray, high: FloatArray) -> Any:
    """Lines across a floor."""
    import k3d

    step = round_below(float(high[0] - low[0]) / 8.0)
    marks = np.arange(np.ceil(low[0] / step), np.floor(high[0] / step) + 1) * step
    ends = np.array([[(x, low[1], 0.0), (x, high[1], 0.0)] for x in marks], dtype=np.float32).reshape(-1, 3)
    indices = np.arange(len(ends), dtype=np.uint32).reshape(-1, 2)
    return k3d.lines(
        ends, indices, indices_type="segment", shader="simple", color=_packed(_RULE), name=f"every {step:g} mm"
    )


def cameras_of(motion: Motion) -> dict[str, list[float]]:
    """Where to look from so that everything is in view, gravity downward: `Scene.cameras`."""
    closed, upward = motion.case.boundary.closed, against_gravity(motion)
    steep = upward[2] < 0.5
    first = np.array([-0.25, -1.0, 0.2] if closed else [-0.1, -0.7, 0.9] if steep else [-0.55, -0.8, 0.6])
    ways = {
        "as at first": (first, upward),
        "from the side": (np.array([0.0, -1.0, 0.0]), upward),
        "onto the floor": (np.array([0.0, 0.0, 1.0]), upward if steep else np.array([0.0, 1.0, 0.0])),
    }
    return {name: _camera(motion, way, up) for name, (way, up) in ways.items()}


def _camera(motion: Motion, way: FloatArray, up: FloatArray) -> list[float]:
    """A camera that way from the middle of the beads, as near as all of them are seen."""
    seen = Camera.around(motion, axes_toward(way, up), share=_MARGIN, shaken=False)
    depth = float(seen.high[2] - seen.low[2])
    distance = seen.height(_ASPECT) / 2.0 / float(np.tan(np.radians(_VIEW / 2.0))) + depth / 2.0
    return [float(one) for one in (*seen.place(distance), *seen.middle, *up)]


def _packed(colour: str) -> int:
    return int(colour[1:], 16)
