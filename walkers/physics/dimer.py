"""Dimers in the notation of the paper: masses, asymmetry, Γ0."""

from __future__ import annotations

from dataclasses import dataclass

from walkers.physics.capillary import bead_volume, capillary_force_limit_at_wall


@dataclass(frozen=True)
class Dimer:
    """The two beads of a walker, and what follows from them in the symbols of the paper.

    Bead 1 is the first bead of the case. Khan et al.: sin δ = (R1 − R2)/(R1 + R2), μ = (m1 − m2)/M,
    R̄ = (R1 + R2)/2, Γ0 = a0 M/(4πγR̄) (their Eq. 1): the inertial force at the peak acceleration a0
    over the mean capillary force.

    Attributes
    ----------
    radii
        R1 and R2, m.
    density
        Density of both beads, kg/m³.
    surface_tension
        γ of the liquid, N/m.
    """

    radii: tuple[float, float]
    density: float
    surface_tension: float

    @property
    def masses(self) -> tuple[float, float]:
        """m1, m2, kg."""
        return bead_volume(self.radii[0]) * self.density, bead_volume(self.radii[1]) * self.density

    @property
    def total_mass(self) -> float:
        """M, kg."""
        return sum(self.masses)

    @property
    def mean_radius(self) -> float:
        """R̄, m."""
        return sum(self.radii) / 2.0

    @property
    def sin_delta(self) -> float:
        """The asymmetry parameter sin δ."""
        return (self.radii[0] - self.radii[1]) / sum(self.radii)

    @property
    def mass_asymmetry(self) -> float:
        """μ."""
        return (self.masses[0] - self.masses[1]) / self.total_mass

    @property
    def capillary_scale(self) -> float:
        """4πγR̄, the mean capillary force on the substrate in the limit of perfect wetting, N."""
        return capillary_force_limit_at_wall(self.surface_tension, self.mean_radius)

    @property
    def reduced_radius(self) -> float:
        """R1 R2/(R1 + R2), m."""
        return self.radii[0] * self.radii[1] / sum(self.radii)

    def gamma0(self, peak_acceleration: float) -> float:
        """Γ0 for a peak acceleration in m/s²."""
        return peak_acceleration * self.total_mass / self.capillary_scale

    def peak_acceleration(self, gamma0: float) -> float:
        """The peak acceleration in m/s² that gives a Γ0."""
        return gamma0 * self.capillary_scale / self.total_mass
