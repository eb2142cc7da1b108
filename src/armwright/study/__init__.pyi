from .study import STUDIES as STUDIES, Study as Study, run_study as run_study
