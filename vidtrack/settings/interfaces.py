"""`interfaces`: windows, tank walls and water surfaces through which cameras see."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from vidtrack.settings.sections import Positive, Section, Vector

Sigma = Annotated[float, Field(ge=0)]
Thickness = Positive | tuple[Positive, ...]


class InterfaceSigma(Section):
    """How well an interface is known; what is not known exactly is refined with the cameras."""

    position: Sigma | None = Field(
        None, description="world units, standard deviation of its place along its normal; default: 5 mm; 0: exact"
    )
    tilt: Sigma | None = Field(
        None, description="degrees, standard deviation of its normal in two directions; default: 0.5; 0: exact"
    )
    thickness: Sigma | None = Field(
        None, description="world units, of each layer's thickness; default: 3 % of it; 0: exact"
    )
    index: Sigma | None = Field(
        None,
        description="standard deviation of the refractive indices; default: 0.001 for the last medium, 0.005 for a "
        "pane; 0: exact",
    )


class Interface(Section):
    """One plane, or parallel planes with layers between them, through which light passes on its way to a camera."""

    point: Vector = Field(description="[x, y, z], world: a point on the plane that is nearest to the camera")
    normal: Vector = Field(description="[x, y, z], direction at right angles to the plane, of any length, either way")
    indices: tuple[Positive, ...] = Field(
        description="refractive indices in the order in which a line of sight passes them, from the camera on: "
        "[1.0, 1.333] for the surface of water seen from air, [1.0, 1.49, 1.333] for a window of acrylic"
    )
    thickness: Thickness | None = Field(
        None, description="world units, of the pane; a list where there are several layers; none for a bare surface"
    )
    sigma: InterfaceSigma = Field(InterfaceSigma(), description="how well it is known: prior of its refinement")

    @model_validator(mode="after")
    def _can_be(self) -> Interface:
        layers = 0 if self.thickness is None else len(self.thickness) if isinstance(self.thickness, tuple) else 1
        if len(self.indices) != layers + 2:
            raise ValueError(
                f"{len(self.indices)} indices for {layers} layers of given thickness; there are two more indices than "
                "layers: [1.0, 1.333] and no thickness for a surface, [1.0, 1.49, 1.333] and one thickness for a window"
            )
        if not all(0.5 < n < 5 for n in self.indices):
            raise ValueError("refractive indices lie between 0.5 and 5")
        if not any(self.normal):
            raise ValueError("the normal has no length")
        return self
