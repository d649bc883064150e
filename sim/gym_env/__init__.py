"""Gymnasium environment of the paint job; the import registers it (docs/gymnasium.md). Needs the extra ``gym``."""

from ibvs_qp.config.errors import ConfigError

try:
    import gymnasium
except ModuleNotFoundError as error:
    if error.name != "gymnasium":
        raise
    raise ConfigError("the environment needs the extra gym: pip install -c constraints.txt -e '.[gym]'") from None

#: Name for `gymnasium.make`; with the module in front, "sim.gym_env:ibvs_qp/Paint-v0", no import is needed before it.
ENVIRONMENT = "ibvs_qp/Paint-v0"

if ENVIRONMENT not in gymnasium.registry:
    gymnasium.register(id=ENVIRONMENT, entry_point="sim.gym_env.environment:PaintEnv")

__all__ = ["ENVIRONMENT"]
