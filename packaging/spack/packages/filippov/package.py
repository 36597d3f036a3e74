# SPDX-License-Identifier: BSD-3-Clause
"""Spack: the headers, of a clone (`spack dev-build -d CLONE filippov@main`)."""

from spack.package import *


class Filippov(CMakePackage):
    """Filippov systems, simulated event by event, with sliding."""

    license("BSD-3-Clause")

    version("main")

    variant("gsl", default=False, description="The component filippov::gsl (GSL is GPL)")

    depends_on("cxx", type="build")
    depends_on("cmake@3.23:", type="build")
    depends_on("eigen@3.4:")
    depends_on("gsl", when="+gsl")

    conflicts("%gcc@:10")

    def cmake_args(self):
        parts = ("TESTS", "EXAMPLES", "BENCH", "PYTHON")
        return [
            *(self.define(f"FILIPPOV_BUILD_{part}", False) for part in parts),
            self.define("FILIPPOV_FETCH", False),
            self.define_from_variant("FILIPPOV_GSL", "gsl"),
        ]
