from ibvs_qp.analysis.contact import contact_mode_damping as contact_mode_damping
from ibvs_qp.analysis.contact import require_margin as require_margin
