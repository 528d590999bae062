from _typeshed import Incomplete

from . import types as types

def __getattr__(name: str) -> Incomplete: ...
