# SPDX-License-Identifier: BSD-3-Clause
# What is installed comes first; a pinned download comes second, and only if FILIPPOV_FETCH is ON.

include(FetchContent)

function(filippov_may_fetch name package)
  if(NOT FILIPPOV_FETCH)
    message(FATAL_ERROR "filippov: ${name} was not found and FILIPPOV_FETCH is OFF. "
                        "Install it (Debian: apt-get install ${package}).")
  endif()
  message(STATUS "filippov: ${name} was not found, fetching a pinned version")
endfunction()

# Eigen's headers from the package index, which building a wheel brings (pyproject.toml).
macro(filippov_find_eigen_of_python)
  find_package(Python QUIET COMPONENTS Interpreter)
  execute_process(
    COMMAND ${Python_EXECUTABLE} -c
            "import importlib.metadata as m; print(m.distribution('cmeel-eigen').locate_file('cmeel.prefix'))"
    OUTPUT_VARIABLE filippov_eigen_prefix OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(filippov_eigen_prefix)
    find_package(Eigen3 QUIET CONFIG PATHS ${filippov_eigen_prefix} NO_DEFAULT_PATH)
  endif()
endmacro()

# Eigen3::Eigen, 3.4 or newer.
macro(filippov_find_eigen)
  if(NOT TARGET Eigen3::Eigen)
    find_package(Eigen3 QUIET CONFIG)
    if(NOT Eigen3_FOUND AND SKBUILD)
      filippov_find_eigen_of_python()
    endif()
    if(Eigen3_FOUND AND Eigen3_VERSION VERSION_LESS 3.4)
      message(FATAL_ERROR "filippov: Eigen ${Eigen3_VERSION} in ${Eigen3_DIR} is older than 3.4.")
    elseif(NOT Eigen3_FOUND)
      filippov_may_fetch("Eigen" libeigen3-dev)
      # Headers only: the folder named here holds no CMakeLists.txt, so none of Eigen's targets,
      # tests or install rules come along.
      FetchContent_Declare(
        eigen3
        GIT_REPOSITORY https://gitlab.com/libeigen/eigen.git
        GIT_TAG 3147391d946bb4b6c68edd901f2add6ac1f31f8c # 3.4.0
        SOURCE_SUBDIR headers-only)
      FetchContent_MakeAvailable(eigen3)
      add_library(Eigen3::Eigen INTERFACE IMPORTED GLOBAL)
      target_include_directories(Eigen3::Eigen INTERFACE ${eigen3_SOURCE_DIR})
    endif()
  endif()
endmacro()

# Catch2::Catch2, version 2 (headers) or 3 (library): tests/catch.hpp serves both.
macro(filippov_find_catch)
  find_package(Catch2 QUIET CONFIG)
  if(NOT Catch2_FOUND)
    filippov_may_fetch("Catch2" catch2)
    FetchContent_Declare(
      Catch2
      GIT_REPOSITORY https://github.com/catchorg/Catch2.git
      GIT_TAG fa43b77429ba76c462b1898d6cd2f2d7a9416b14 # 3.7.1
    )
    FetchContent_MakeAvailable(Catch2)
    # Our warnings are not Catch2's.
    target_compile_options(Catch2 PRIVATE $<IF:$<CXX_COMPILER_ID:MSVC>,/w,-w>)
    set_target_properties(Catch2 PROPERTIES INTERFACE_SYSTEM_INCLUDE_DIRECTORIES
                          $<TARGET_PROPERTY:Catch2,INTERFACE_INCLUDE_DIRECTORIES>)
  endif()
endmacro()
