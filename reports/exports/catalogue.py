"""What parameters can be exported for, by the name that a person types."""

from collections.abc import Mapping

from reports.exports.controllers import moteus, odrive, simplefoc, st, ti, vesc
from reports.exports.files import c_header, csv_file, json_file
from reports.exports.simulators import gym_electric_motor, mathworks, motulator
from reports.exports.target import Target

TARGETS: Mapping[str, Target] = {
    target.name: target
    for target in (
        vesc.TARGET,
        odrive.TARGET,
        odrive.TARGET_06,
        simplefoc.TARGET,
        moteus.TARGET,
        ti.TARGET,
        st.TARGET,
        mathworks.TARGET,
        motulator.TARGET,
        gym_electric_motor.TARGET,
        json_file.TARGET,
        csv_file.TARGET,
        c_header.TARGET,
    )
}
