// expect: filippov: wrong arguments are refused by exceptions: compile without -fno-exceptions
// options: -fno-exceptions
#include <filippov/engine/trajectory.hpp>
