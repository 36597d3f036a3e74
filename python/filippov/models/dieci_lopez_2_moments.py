# SPDX-License-Identifier: BSD-3-Clause
"""`dieci_lopez_2` with the fields blended by the moments of Dieci and Difonzo; compiled."""

from __future__ import annotations

from filippov._system.built_in import compiled

dieci_lopez_2_moments = compiled("dieci_lopez_2_moments", ["x2 - 0.2", "x3 - 0.4"])
