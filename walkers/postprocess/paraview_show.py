"""Show a run of wet granular walkers in ParaView: spheres, bridges, walls and the time, as in the film.

    paraview --script=show.py          (or in ParaView: File > Load State, this file)
    pvpython show.py picture.png 0.1   a picture at 0.1 s; without a screen: xvfb-run -a pvpython ...

It is the same for all runs and reads the files beside it, which `walkers export` writes.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree


def main() -> None:
    """Show the run; with arguments write a picture."""
    from paraview import simple

    collection = Path(globals().get("__file__", "show.py")).absolute().with_name("walkers.pvd")
    listing = ElementTree.parse(collection).getroot()
    run = json.loads(listing.attrib["view"])
    arguments = [text for text in sys.argv[1:] if not text.startswith("-")] if __name__ == "__main__" else []
    simple._DisableFirstRenderCameraReset()
    simple.LoadPalette("WhiteBackground")
    view = simple.GetActiveViewOrCreate("RenderView")
    if arguments:
        view.ViewSize = [1280, 720]
    reader = simple.PVDReader(registrationName="run", FileName=str(collection))
    times = list(reader.TimestepValues)
    view.ViewTime = min(times, key=lambda time: abs(time - float(arguments[1]))) if arguments[1:] else times[0]
    reader.UpdatePipeline(view.ViewTime)
    parts = {
        name: simple.ExtractBlock(registrationName=name, Input=reader, Selectors=[f"//{name}"])
        for name in {entry.attrib["name"] for entry in listing.iter("DataSet")}
    }
    _show_beads(simple, parts["beads"], run)
    _show_walls(simple, parts["boundary"], closed=run["closed"])
    if "bridges" in parts:  # tubes inside the beads, which show where a bridge is: between them
        lines = simple.ExtractSurface(registrationName="lines", Input=parts["bridges"])
        tubes = simple.Tube(registrationName="tubes", Input=lines, Radius=run["neck"], NumberofSides=16)
        _painted(simple.Show(tubes), 0.15, 0.45, 0.85)
    clock = simple.AnnotateTimeFilter(registrationName="time", Input=reader)
    # ParaView 5.10 and older: as printf.
    clock.Format = "{time:.4f} s" if simple.GetParaViewVersion() >= (5, 11) else "%.4f s"
    _write(simple.Show(clock), "Upper Left Corner", 20)
    if run["tilted"]:
        tilt = simple.Text(registrationName="tilt", Text=f"{run['tilted']}; gravity points down in this view")
        _write(simple.Show(tilt), "Lower Left Corner", 16)
    view.CameraParallelProjection, view.CameraParallelScale = 1, run["half"]
    view.CameraFocalPoint, view.CameraPosition, view.CameraViewUp = run["middle"], run["camera"], run["up"]
    view.OrientationAxesVisibility = 0
    simple.Render(view)
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    scene.AnimationTime = view.ViewTime
    if arguments:
        simple.SaveScreenshot(arguments[0], view)


def _show_beads(simple: Any, beads: Any, run: dict[str, Any]) -> None:
    """A glyph of radius 0.5 times 2 radius; of points VTK makes no such spheres by itself."""
    spheres = simple.Glyph(registrationName="spheres", Input=beads, GlyphType="Sphere", GlyphMode="All Points")
    spheres.OrientationArray = ["POINTS", "No orientation array"]
    spheres.ScaleArray, spheres.ScaleFactor = ["POINTS", "radius (m)"], 2.0
    spheres.GlyphType.ThetaResolution = spheres.GlyphType.PhiResolution = run["rounds"]
    shown, colour = simple.Show(spheres), run["colour"]
    shown.Specular = 0.4
    simple.ColorBy(shown, ("POINTS", colour))
    scale, has_unit = simple.GetColorTransferFunction(colour), "(" in colour
    if run["largest"] is None:
        shown.RescaleTransferFunctionToDataRange(False, True)
    else:
        scale.RescaleTransferFunction(0.0, run["largest"])
    if has_unit:
        bar = simple.GetScalarBar(scale)
        bar.Title, bar.ComponentTitle = colour, ""
    shown.SetScalarBarVisibility(simple.GetActiveView(), has_unit)


def _show_walls(simple: Any, boundary: Any, *, closed: bool) -> None:
    walls = simple.ExtractSurface(registrationName="walls", Input=boundary)
    shown = _painted(simple.Show(walls), 0.78, 0.82, 0.85)
    if closed:
        shown.Opacity = 0.15
        edges = simple.FeatureEdges(registrationName="edges", Input=walls)
        _painted(simple.Show(edges), 0.35, 0.4, 0.44).LineWidth = 2.0
    else:
        shown.Ambient, shown.Diffuse = 1.0, 0.0


def _painted(shown: Any, *colour: float) -> Any:
    shown.ColorArrayName = ["POINTS", ""]
    shown.AmbientColor = shown.DiffuseColor = colour
    return shown


def _write(shown: Any, place: str, size: int) -> None:
    shown.WindowLocation, shown.FontSize, shown.Color = place, size, [0.0, 0.0, 0.0]


if not __name__.startswith("walkers."):  # in ParaView its name depends on how it is started
    main()
