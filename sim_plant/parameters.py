"""Parameters of the simulated rig: dimensions, valve, pneumatics, sensors.

Figures come from W. B. Dunbar's thesis (1999), Table 5.1 and section 5.4, if it prints them. The
others are marked "chosen": they reproduce the frequency response, the amplitude dependence and the
accelerations of the thesis, within the range of such parts.
"""

from typing import Annotated

import numpy as np
from msgspec import Meta, structs
from numpy.typing import NDArray

from rigwatch.wire.typed_files import Section

INCH = 0.0254
"""[m]"""
GRAVITY = 9.80665
"""[m/s^2]"""


def _positive(description: str) -> Meta:
    return Meta(gt=0, description=description)


def _not_negative(description: str) -> Meta:
    return Meta(ge=0, description=description)


class RigParameters(Section, frozen=True, kw_only=True):
    """The rig; every key has a default, so that a file names only deviations."""

    sample_rate: Annotated[float, _positive("samples a second [Hz]")] = 256.0
    substeps: Annotated[int, Meta(ge=4, le=256, description="integration steps a sample")] = 16

    bore: Annotated[float, _positive("cylinder bore [m]")] = 0.366 * INCH
    rod: Annotated[float, _positive("rod diameter [m]")] = 0.125 * INCH
    stroke: Annotated[float, _positive("stroke [m]")] = 5.0 * INCH
    piston_mass: Annotated[float, _positive("piston and rod [kg]")] = 0.0113
    load_mass: Annotated[float, _positive("air-bearing mass [kg]")] = 0.2201
    dead_volume: Annotated[float, _positive("fittings and hose at each chamber, chosen [m^3]")] = (
        1.15e-6
    )
    piston_viscous: Annotated[
        float, _not_negative("viscous friction of the piston, chosen [N s/m]")
    ] = 0.05
    piston_coulomb: Annotated[
        float, _not_negative("dry friction of the healthy anti-stiction cylinder [N]")
    ] = 0.0
    stop_stiffness: Annotated[float, _positive("end stops, chosen [N/m]")] = 1.0e5
    stop_damping: Annotated[float, _not_negative("end stops, chosen [N s/m]")] = 100.0

    atmosphere: Annotated[float, _positive("exhaust pressure, absolute [Pa]")] = 101.0e3
    mean_pressure: Annotated[
        float, _positive("both upstream pressures at the valve's null, chosen [Pa]")
    ] = 300.0e3
    highest_pressure: Annotated[
        float, _positive("80 % recovery of the lowest supply pressure [Pa]")
    ] = 542.0e3
    pressure_per_volt: Annotated[
        float, _positive("change of each upstream pressure, chosen [Pa/V]")
    ] = 40.0e3
    valve_limit: Annotated[float, _positive("largest drive voltage [V]")] = 5.0
    valve_frequency: Annotated[float, _positive("natural frequency, chosen [Hz]")] = 30.0
    valve_damping: Annotated[
        float, Meta(ge=1, description="damping ratio of the heavily damped flapper, chosen")
    ] = 1.667
    temperature: Annotated[float, _positive("of the air [K]")] = 294.0
    heat_capacity_ratio: Annotated[float, Meta(ge=1, le=1.67, description="gamma of air")] = 1.4
    discharge: Annotated[float, _positive("coefficient of the orifices")] = 0.85
    port_area: Annotated[float, _positive("orifice of each port, chosen [mm^2]")] = 0.5
    port_resistance: Annotated[
        float, _positive("laminar, of each line from the valve's nozzle, chosen [Pa s/m^3]")
    ] = 7.0e9
    piston_leak: Annotated[float, _not_negative("clearance seal, as an orifice, chosen [mm^2]")] = (
        0.006
    )
    leak_resistance: Annotated[float, _positive("laminar, of a leak, chosen [Pa s/m^3]")] = 5.0e9

    centring_gain: Annotated[
        float, _not_negative("drive voltage per offset of the slow centring loop, chosen [V/m]")
    ] = 16.0
    centring_frequency: Annotated[
        float, _positive("low-pass of the centring pick-off, chosen [Hz]")
    ] = 0.7

    lvdt_range: Annotated[float, _positive("half range [m]")] = 1.0 * INCH
    lvdt_gain: Annotated[float, _positive("[V/m]")] = 10.0 / INCH
    lvdt_resolution: Annotated[float, _not_negative("smallest step, 0 for none [m]")] = 0.001 * INCH
    lvdt_noise: Annotated[float, _not_negative("rms, chosen [m]")] = 7.62e-6
    accelerometer_range: Annotated[float, _positive("half range [m/s^2]")] = 50.0 * GRAVITY
    accelerometer_gain: Annotated[float, _positive("[V/(m/s^2)]")] = 0.1014 / GRAVITY
    accelerometer_corner: Annotated[float, _positive("piezo high-pass, chosen [Hz]")] = 0.5
    accelerometer_bandwidth: Annotated[
        float, _positive("charge amplifier's low-pass, chosen [Hz]")
    ] = 1000.0
    accelerometer_noise: Annotated[float, _not_negative("rms, chosen [m/s^2]")] = 0.003 * GRAVITY
    voltage_noise: Annotated[float, _not_negative("rms, chosen [V]")] = 0.5e-3
    adc_range: Annotated[float, _positive("rails of voltage and position inputs [V]")] = 10.0
    adc_range_acceleration: Annotated[float, _positive("rails of the acceleration input [V]")] = (
        5.07
    )
    clock_drift: Annotated[float, Meta(description="error of the device's clock [ppm]")] = 0.0

    @property
    def piston_area(self) -> float:
        """Area of chamber 1 [m^2]."""
        return float(np.pi * self.bore**2 / 4)

    @property
    def annulus_area(self) -> float:
        """Area of chamber 2, less the rod [m^2]."""
        return self.piston_area - float(np.pi * self.rod**2 / 4)

    @property
    def volts_per_code(self) -> NDArray[np.float64]:
        """Of the three converters: voltage, position, acceleration [V]."""
        return np.array([self.adc_range, self.adc_range, self.adc_range_acceleration]) / 32768.0

    @property
    def si_per_code(self) -> NDArray[np.float64]:
        """Calibration of the three channels [V, m, m/s^2 per code]."""
        gains = np.array([1.0, self.lvdt_gain, self.accelerometer_gain])
        return np.asarray(self.volts_per_code / gains, dtype=np.float64)


def as_record(parameters: RigParameters) -> NDArray[np.void]:
    """The parameters as one record of float64, as the kernels read them; shape (1,)."""
    values = structs.asdict(parameters) | {
        "piston_area": parameters.piston_area,
        "annulus_area": parameters.annulus_area,
    }
    record = np.zeros(1, dtype=[(name, np.float64) for name in values])
    for name, value in values.items():
        record[name] = value
    return record
