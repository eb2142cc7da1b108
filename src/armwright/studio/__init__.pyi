from .studio import Studio as Studio
from .widget import show as show
