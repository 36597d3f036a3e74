// SPDX-License-Identifier: BSD-3-Clause
// Tapes that the library filippov::compiled runs: see the end of tape.hpp.
#include <filippov/formulas/tape.hpp>

namespace filippov {

template void Tape::interpret(Taylor<double, 1>*, const Taylor<double, 1>&,
                              const Taylor<double, 1>*, const Taylor<double, 1>*,
                              Taylor<double, 1>*) const;
template void Tape::interpret(Taylor<double, 2>*, const Taylor<double, 2>&,
                              const Taylor<double, 2>*, const Taylor<double, 2>*,
                              Taylor<double, 2>*) const;
template void Tape::interpret(Taylor<double, 4>*, const Taylor<double, 4>&,
                              const Taylor<double, 4>*, const Taylor<double, 4>*,
                              Taylor<double, 4>*) const;
template void Tape::interpret(Taylor<double, 9>*, const Taylor<double, 9>&,
                              const Taylor<double, 9>*, const Taylor<double, 9>*,
                              Taylor<double, 9>*) const;

} // namespace filippov
