"""Whether this machine can draw pictures without a screen.

VTK draws them by EGL, or by OSMesa where there is no EGL. If it finds neither, it does not raise an
error: the process ends by a segmentation fault. So this is found out before VTK draws.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from functools import lru_cache

from walkers.errors import input_error

WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"
"""Variable of the environment with the class of VTK's windows."""
_EGL_WINDOW = "vtkEGLRenderWindow"
"""Class of windows that need no screen."""
PACKAGES = "libegl1 libgl1 libgl1-mesa-dri libxrender1"
"""Packages of Debian that VTK needs to draw."""
_MOST_DEVICES = 16
"""Largest number of devices that are looked at."""
_PLATFORM_DEVICE = 0x313F
"""``EGL_PLATFORM_DEVICE_EXT``."""
_TRIAL = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=[8, 8])
plotter.render()
plotter.screenshot(return_img=True)
"""
"""A program that draws an empty picture."""


def prepare_drawing() -> None:
    """Have VTK draw without a screen.

    Raises
    ------
    InputError
        If this machine lacks what VTK needs for that.
    """
    # Otherwise VTK first tries an X server, and prints an error if there is none.
    os.environ.setdefault(WINDOW, _EGL_WINDOW)
    if not _can_draw():
        raise input_error(
            "pictures",
            "need OpenGL without a screen, by EGL or OSMesa, which this machine lacks; "
            f"on Debian: sudo apt-get install {PACKAGES}",
        )


@lru_cache
def _can_draw() -> bool:
    """Whether VTK can draw, by a question to EGL or, if that does not suffice, by a trial."""
    if os.environ[WINDOW] == _EGL_WINDOW and _has_egl_device():
        return True
    trial = subprocess.run([sys.executable, "-c", _TRIAL], capture_output=True, check=False)
    return trial.returncode == 0


def _has_egl_device() -> bool:
    """Whether EGL can be loaded and initialises a device; this takes some hundredths of a second.

    The functions are those of the extensions ``EGL_EXT_device_base`` and
    ``EGL_EXT_platform_device``, which VTK needs, too.
    """
    try:
        egl = ctypes.CDLL("libEGL.so.1")
    except OSError:
        return False
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    egl.eglGetProcAddress.argtypes = [ctypes.c_char_p]
    egl.eglInitialize.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]
    query_devices = egl.eglGetProcAddress(b"eglQueryDevicesEXT")
    display_of_platform = egl.eglGetProcAddress(b"eglGetPlatformDisplayEXT")
    if not query_devices or not display_of_platform:
        return False
    query = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)
    display_of = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p)
    devices = (ctypes.c_void_p * _MOST_DEVICES)()
    count = ctypes.c_int()
    query(query_devices)(_MOST_DEVICES, devices, ctypes.byref(count))
    for device in devices[: count.value]:
        display = display_of(display_of_platform)(_PLATFORM_DEVICE, device, None)
        if display and egl.eglInitialize(display, None, None):
            return True
    return False
