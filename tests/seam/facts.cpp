// SPDX-License-Identifier: BSD-3-Clause
// Compiled for several instruction sets, and with an option that does change the layout.
#include <filippov/ensemble/seam.hpp>

extern "C" [[gnu::visibility("default")]] void
seam_facts(void* to, void (*tell)(void* to, const char* what, const char* value)) {
    for (const auto& [what, value] : filippov::seam_facts())
        tell(to, what.c_str(), value.c_str());
}
