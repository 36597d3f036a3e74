// expect: filippov: the defaults of a system that is made at run time are its own
#include <filippov/formulas/tape_system.hpp>

int main() { return int(filippov::default_params<filippov::TapeSystem<2, 1, 8>>()[0]); }
