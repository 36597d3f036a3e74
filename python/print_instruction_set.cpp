// SPDX-License-Identifier: BSD-3-Clause
// Tells CMake for which instruction set lanes are compiled on this machine.
#include "src/instruction_set.hpp"

#include <cstdio>

int main() { std::printf("%s", filippov::python::instruction_set()); }
