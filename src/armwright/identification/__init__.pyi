from .model import BaseParameters as BaseParameters, DynamicModel as DynamicModel
from .structure import structural_count as structural_count
