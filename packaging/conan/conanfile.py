# SPDX-License-Identifier: BSD-3-Clause
"""Conan 2: the headers."""

import re
from pathlib import Path

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.files import copy, load
from conan.tools.layout import basic_layout

ROOT = "../.."


class Filippov(ConanFile):
    name = "filippov"
    description = "Filippov systems, simulated event by event, with sliding"
    license = "BSD-3-Clause"
    topics = ("ode", "filippov", "sliding", "bifurcation", "header-only")
    package_type = "header-library"
    settings = "os", "arch", "compiler", "build_type"
    no_copy_source = True
    requires = "eigen/[>=3.4 <4]"

    def set_version(self):
        header = load(self, Path(self.recipe_folder) / ROOT / "include/filippov/version.hpp")
        self.version = re.search(r'#define FILIPPOV_VERSION "([^"]+)"', header)[1]

    def export_sources(self):
        root = Path(self.recipe_folder) / ROOT
        for pattern in ("CMakeLists.txt", "LICENSE", "cmake/*", "include/*"):
            copy(self, pattern, root, self.export_sources_folder)

    def layout(self):
        basic_layout(self, src_folder=".")

    def validate(self):
        check_min_cppstd(self, 20)

    def package(self):
        copy(self, "LICENSE", self.source_folder, Path(self.package_folder) / "licenses")
        copy(self, "include/*", self.source_folder, self.package_folder, excludes="*/gsl/*")

    def package_id(self):
        self.info.clear()

    def package_info(self):
        self.cpp_info.bindirs = self.cpp_info.libdirs = []
        self.cpp_info.set_property("cmake_file_name", "filippov")
        self.cpp_info.set_property("cmake_target_name", "filippov::filippov")
        if self.settings.compiler in ("gcc", "clang", "apple-clang"):
            self.cpp_info.cxxflags = ["-ffp-contract=off"]  # fused products only where asked for
