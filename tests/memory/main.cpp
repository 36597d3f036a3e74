// SPDX-License-Identifier: BSD-3-Clause
// The table of wrong arguments as a plain program: every function in it is compiled here, so that
// the memory sanitizer sees what is read before it was written.
#include "../arguments.hpp"

#include <cstdio>

int main() {
    const arguments::Judge judge = arguments::judged();
    for (const std::string& fault : judge.faults)
        std::printf("%s\n", fault.c_str());
    std::printf("%d cases, %zu faults\n", judge.cases, judge.faults.size());
    return judge.faults.empty() ? 0 : 1;
}
