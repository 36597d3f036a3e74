// SPDX-License-Identifier: BSD-3-Clause
// Tapes that the library filippov::compiled runs: see the end of tape.hpp.
#include <filippov/formulas/tape.hpp>

namespace filippov {

template struct Tape::Interpreter<Taylor<double, 1>>;
template struct Tape::Interpreter<Taylor<double, 2>>;
template struct Tape::Interpreter<Taylor<double, 4>>;
template struct Tape::Interpreter<Taylor<double, 9>>;
template struct Tape::Interpreter<Taylor<Taylor<double, 1>, 1>>;
template struct Tape::Interpreter<Taylor<Taylor<double, 2>, 1>>;
template struct Tape::Interpreter<Taylor<Taylor<double, 4>, 1>>;
template struct Tape::Interpreter<Taylor<Taylor<Taylor<double, 1>, 1>, 1>>;
template struct Tape::Interpreter<Taylor<Taylor<Taylor<double, 2>, 1>, 1>>;
template struct Tape::Interpreter<Taylor<Taylor<Taylor<double, 4>, 1>, 1>>;
template struct Tape::Interpreter<Dual<Dual<double, 2>, 2>>;

} // namespace filippov
