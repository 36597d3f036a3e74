# SPDX-License-Identifier: BSD-3-Clause
"""The recipes in packaging/ parse, and say what the project says."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGING = ROOT / "packaging"
VERSION = re.search(
    r'#define FILIPPOV_VERSION "([^"]+)"', (ROOT / "include/filippov/version.hpp").read_text()
)[1]


def test_vcpkg_knows_version_licence_dependencies_and_options():
    port = json.loads((PACKAGING / "vcpkg/filippov/vcpkg.json").read_text())
    assert port["version"] == VERSION
    assert port["license"] == "BSD-3-Clause"
    assert "eigen3" in port["dependencies"]
    options = set(re.findall(r"option\((FILIPPOV_\w+)", (ROOT / "CMakeLists.txt").read_text()))
    assert set(re.findall(r"-D(FILIPPOV_\w+)=", portfile())) <= options
    assert re.search(r"SOURCE_PATH .*/\.\./\.\./\.\.\"", portfile())
    installed = re.search(
        r"FILIPPOV_INSTALL_CMAKEDIR \$\{CMAKE_INSTALL_DATADIR\}/(\S+)\)",
        (ROOT / "CMakeLists.txt").read_text(),
    )[1]
    assert f"CONFIG_PATH share/{installed})" in portfile()


def test_the_citation_names_the_version():
    assert f"{{Version {VERSION}}}" in (ROOT / "docs/cite.md").read_text()


def portfile():
    return (PACKAGING / "vcpkg/filippov/portfile.cmake").read_text()


def test_the_port_is_cmake(tmp_path):
    cmake = shutil.which("cmake") or pytest.skip("no cmake")
    # vcpkg's functions, as far as the port calls them
    calls = sorted(set(re.findall(r"^(vcpkg_\w+)\(", portfile(), re.MULTILINE)))
    script = "".join(f"function({call})\nendfunction()\n" for call in calls)
    script += f'set(CURRENT_PACKAGES_DIR "{tmp_path}/packages")\nset(PORT filippov)\n'
    script += f'include("{PACKAGING}/vcpkg/filippov/portfile.cmake")\n'
    script += (
        f'if(NOT SOURCE_PATH STREQUAL "{ROOT}")\nmessage(FATAL_ERROR "${{SOURCE_PATH}}")\nendif()\n'
    )
    (tmp_path / "port.cmake").write_text(script)
    subprocess.run([cmake, "-P", tmp_path / "port.cmake"], check=True, timeout=60)
    assert (tmp_path / "packages/share/filippov/usage").is_file()


def test_conda_names_what_pip_needs():
    jinja = pytest.importorskip("jinja2")
    yaml = pytest.importorskip("yaml")
    header = (ROOT / "include/filippov/version.hpp").read_text()
    shown = jinja.Template((PACKAGING / "conda/meta.yaml").read_text()).render(
        load_file_regex=lambda load_file, regex_pattern, from_recipe_dir: re.search(
            regex_pattern, header if load_file == "include/filippov/version.hpp" else ""
        ),
        PYTHON="python",
        compiler=lambda name: f"{name}-compiler",
        stdlib=lambda name: f"{name}-stdlib",
    )
    recipe = yaml.safe_load(shown)
    assert recipe["package"] == {"name": "filippov", "version": VERSION}
    assert recipe["about"]["license"] == "BSD-3-Clause"
    if sys.version_info >= (3, 11):
        import tomllib

        project = tomllib.loads((ROOT / "pyproject.toml").read_text())
        host = {need.split()[0] for need in recipe["requirements"]["host"]}
        for need in project["build-system"]["requires"]:
            name = re.match(r"[\w-]+", need)[0]
            assert {"cmeel-eigen": "eigen"}.get(name, name) in host
        run = {need.replace(" ", "") for need in recipe["requirements"]["run"]}  # "numpy >=1.23"
        assert set(project["project"]["dependencies"]) <= run


def test_spack_names_options_and_dependencies():
    text = (PACKAGING / "spack/packages/filippov/package.py").read_text()
    (recipe,) = [n for n in ast.parse(text).body if isinstance(n, ast.ClassDef)]
    assert recipe.name == "Filippov"
    options = set(re.findall(r"option\((FILIPPOV_\w+)", (ROOT / "CMakeLists.txt").read_text()))
    assert {"FILIPPOV_FETCH", "FILIPPOV_GSL"} <= options
    minimum = re.search(r"VERSION (3\.\d+)\.\.\.", (ROOT / "CMakeLists.txt").read_text())[1]
    assert f'depends_on("cmake@{minimum}:"' in text
    assert (PACKAGING / "spack/repo.yaml").is_file()


EIGEN = """
from conan import ConanFile

class Eigen(ConanFile):  # the one of this machine, as ConanCenter's is called
    name, version, package_type = "eigen", "3.4.0", "header-library"

    def package_info(self):
        self.cpp_info.set_property("cmake_file_name", "Eigen3")
        self.cpp_info.set_property("cmake_target_name", "Eigen3::Eigen")
        self.cpp_info.includedirs = ["/usr/include/eigen3"]
        self.cpp_info.bindirs = self.cpp_info.libdirs = []
"""

CONSUMER = """
cmake_minimum_required(VERSION 3.23)
project(consumer LANGUAGES CXX)
find_package(filippov REQUIRED CONFIG)
add_executable(consumer main.cpp second.cpp)
target_link_libraries(consumer PRIVATE filippov::filippov)
"""


@pytest.mark.skipif(not Path("/usr/include/eigen3").is_dir(), reason="no Eigen on the machine")
def test_conan_makes_a_package_that_a_project_uses(tmp_path):
    here = Path(sys.executable).parent / "conan"
    conan = here if here.is_file() else shutil.which("conan") or pytest.skip("no conan")
    cmake = shutil.which("cmake") or pytest.skip("no cmake")
    home = {**os.environ, "CONAN_HOME": str(tmp_path / "home")}

    def run(*command):
        ran = subprocess.run(
            command,
            cwd=tmp_path,
            env=home,
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
        assert ran.returncode == 0, ran.stdout + ran.stderr
        return ran.stdout

    (tmp_path / "eigen").mkdir()
    (tmp_path / "eigen/conanfile.py").write_text(EIGEN)
    run(conan, "profile", "detect")
    run(conan, "create", "eigen", "--no-remote")
    new = ("-s", "compiler.cppstd=20", "-s", "build_type=Release")
    run(conan, "create", PACKAGING / "conan", "--no-remote", *new)
    generators = ("-g", "CMakeDeps", "-g", "CMakeToolchain")
    run(
        conan,
        "install",
        f"--requires=filippov/{VERSION}",
        "--no-remote",
        *new,
        *generators,
        "-of=deps",
    )
    (tmp_path / "CMakeLists.txt").write_text(CONSUMER)
    for name in ("main.cpp", "second.cpp"):
        shutil.copy(ROOT / "tests/consumer" / name, tmp_path)
    toolchain = "-DCMAKE_TOOLCHAIN_FILE=deps/conan_toolchain.cmake"
    run(cmake, "-S", ".", "-B", "build", "-G", "Ninja", toolchain, "-DCMAKE_BUILD_TYPE=Release")
    run(cmake, "--build", "build")
    assert run(tmp_path / "build/consumer") == f"filippov {VERSION}\n"
