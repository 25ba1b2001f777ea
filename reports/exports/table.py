"""What parameters can be exported for, by the name that a person types."""

from collections.abc import Mapping

from reports.exports import (
    c_header,
    csv_file,
    gym_electric_motor,
    json_file,
    mathworks,
    moteus,
    motulator,
    odrive,
    simplefoc,
    st,
    ti,
    vesc,
)
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
