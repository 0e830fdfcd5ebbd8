"""What an experiment file may say."""

from typing import Annotated, Any, Literal

from pydantic import (
    Field,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from vlnhijack.agents.precision import Precision
from vlnhijack.experiments.yaml_config import Settings, SquareInt

CATEGORIES = ("chair", "cabinet", "table", "plant", "sofa", "tv_monitor")
Kind = Literal["single_step", "trajectory"]
Rung = Literal["frozen", "fixed-illumination", "prb"]
Share = Annotated[float, Field(ge=0, le=1)]
Beta = Annotated[float, Field(ge=0, lt=1)]


class PickedInstance(Settings):
    """One attack chosen by hand; target is the last viewpoint of the attack trajectory."""

    kind: Kind
    house: str
    object: str
    viewpoint: str
    target: str | None = None

    @field_validator("target")
    @classmethod
    def _only_for_trajectories(cls, target: str | None, info: ValidationInfo) -> str | None:
        if target is not None and info.data.get("kind") == "single_step":
            raise PydanticCustomError("target", "no target: a single_step attack stops at once")
        return target


class DrawnInstances(Settings):
    """Attacks drawn by the seed among all that fulfil the rules of the paper, section 3.2."""

    kind: Kind
    houses: list[str]
    count: PositiveInt


class StoredInstances(Settings):
    """The attacks of a .json that `vlnhijack instances` wrote; every scan is a house."""

    file: str


class InstanceRules(Settings):
    """Which attacks are possible; the defaults are the paper's (section 3.2).

    An object of `categories` fills at least min_coverage (at most max_coverage) of a view at
    v_ATK; at least min_train training episodes on min_paths paths pass through v_ATK after leaving
    out those with a test episode's guide trajectory; at least min_test test episodes. The attack
    trajectory ends at least target_distance metres (geodesic) from every test episode's goal, at
    most max_steps edges from v_ATK; if target_apart also target_distance from v_ATK, if
    target_off_path at no viewpoint of a test path from v_ATK on. validation is the share of paths
    kept for choosing the checkpoint.
    """

    categories: tuple[str, ...] = CATEGORIES
    min_coverage: Share = 0.4
    max_coverage: Share = 1.0
    min_train: PositiveInt = 5
    min_paths: Annotated[int, Field(ge=2)] = 2
    min_test: PositiveInt = 1
    target_distance: PositiveFloat = 3.0
    target_apart: bool = False
    target_off_path: bool = False
    max_steps: PositiveInt = 5
    validation: Annotated[float, Field(gt=0, lt=1)] = 0.2


class DatasetFiles(Settings):
    """Files of a data set that do not lie where they are looked for."""

    connectivity: str | None = None
    boxes: str | None = None
    categories: str | None = None


class DatasetInstances(Settings):
    """How `vlnhijack instances` makes attacks from a data set.

    visibility: an object fills of a view what its REVERIE box does, or its rendered mask;
    category_map: its category is the mpcat40 category of its name, or the name itself; languages
    of RxR ("en", "hi-IN", …), all by default; first_viewpoint, last_viewpoint: whether these of a
    path may be v_ATK; per_instruction: an attack for every instruction instead of one for all of a
    path; max_objects: attacks on so many objects, drawn by the seed.
    """

    dataset: Literal["r2r", "r4r", "rxr", "houses"] = "r2r"
    visibility: Literal["reverie-boxes", "masks"] = "reverie-boxes"
    seed: int = 0
    kind: Kind = "trajectory"
    category_map: Literal["mpcat40", "name"] = "mpcat40"
    languages: tuple[str, ...] = ()
    first_viewpoint: bool = True
    last_viewpoint: bool = True
    per_instruction: bool = False
    max_objects: PositiveInt | None = None
    rules: InstanceRules = InstanceRules()
    files: DatasetFiles = DatasetFiles()


class RenderSettings(Settings):
    """Renderer of an attack, and samples per pixel of the attack, validation and evaluation.

    refresh_every is the number of iterations after which `fixed-illumination` renews its light; 0
    keeps that of the original texture. max_memory, in megabytes, bounds what building an operator
    takes besides the operator.
    """

    rung: Rung = "frozen"
    attack_spp: SquareInt = 16
    evaluation_spp: SquareInt = 16
    refresh_every: NonNegativeInt = 0
    max_memory: PositiveFloat = 512

    @property
    def name(self) -> str:
        """What tells attacks apart, such as "frozen_16spp"; with its refreshes where it has any."""
        refreshed = f"_refresh{self.refresh_every}" if self.refresh_every else ""
        return f"{self.rung}_{self.attack_spp}spp{refreshed}"


class PrecisionSettings(Settings):
    """In which the transformers multiply while a texture is optimised; validation and evaluation
    are in float32. See `default_precision` for what is not set."""

    vision: Precision | None = None
    policy: Precision | None = None


class AttackSettings(Settings):
    """The paper's settings (section 4); see AttackSchedule."""

    iterations: PositiveInt = 300
    batch: PositiveInt = 16
    epsilon: Annotated[float, Field(gt=0, le=1)] = 0.3
    lr: PositiveFloat = 0.01
    betas: tuple[Beta, Beta] = (0.9, 0.999)
    checkpoint_every: PositiveInt = 30
    rendered_viewpoints: PositiveInt = 3


class ExperimentConfig(Settings):
    """An experiment: an agent, attacks on it, and how they are made.

    rendering: one group, or a list of them; then every instance is attacked once with each.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]+$")]
    note: str = ""
    seed: int = 0
    threads: PositiveInt = 2
    agent: str = "small"
    instances: list[PickedInstance] | DrawnInstances | StoredInstances
    rules: InstanceRules = InstanceRules()
    rendering: RenderSettings | Annotated[list[RenderSettings], Field(min_length=1)] = (
        RenderSettings()
    )
    attack: AttackSettings = AttackSettings()
    precision: PrecisionSettings = PrecisionSettings()

    @field_validator("instances")
    @classmethod
    def _once(cls, instances: Any) -> Any:
        picked = instances if isinstance(instances, list) else []
        places = {(p.kind, p.house, p.object, p.viewpoint) for p in picked}
        if len(places) < len(picked):
            raise PydanticCustomError("instances", "each kind, house, object and viewpoint once")
        return instances

    @property
    def renderings(self) -> list[RenderSettings]:
        """The groups of `rendering`, at least one."""
        return self.rendering if isinstance(self.rendering, list) else [self.rendering]

    @property
    def evaluation_spp(self) -> int:
        """Samples per pixel of every evaluation, whatever the attack was rendered with."""
        return self.renderings[0].evaluation_spp

    @model_validator(mode="after")
    def _comparable(self) -> "ExperimentConfig":
        """Renderings are told apart by their names, and what they made is evaluated alike."""
        if len({each.name for each in self.renderings}) < len(self.renderings):
            raise ValueError("rendering: each rung, attack_spp and refresh_every once")
        if len({each.evaluation_spp for each in self.renderings}) > 1:
            raise ValueError("rendering.evaluation_spp must be the same in the whole list")
        return self

    @model_validator(mode="after")
    def _refreshes_at_checkpoints(self) -> "ExperimentConfig":
        """A resumed attack has the light of the whole one only if checkpoints are refreshes."""
        checkpoint = self.attack.checkpoint_every
        for rendering in self.renderings:
            every = rendering.refresh_every
            if every and rendering.rung != "fixed-illumination":
                raise ValueError("rendering.refresh_every needs rendering.rung: fixed-illumination")
            if every and checkpoint % every:
                raise ValueError(
                    f"attack.checkpoint_every ({checkpoint}) must be a multiple of "
                    f"rendering.refresh_every ({every})"
                )
        return self
