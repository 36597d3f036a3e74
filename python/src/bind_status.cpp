// SPDX-License-Identifier: BSD-3-Clause
#include "bind.hpp"

#include <filippov/core/status.hpp>
#include <filippov/run/event.hpp>

namespace filippov::python {

void bind_status(py::module_& m) {
    m.def("status_names", [] {
        std::vector<std::string> names;
        for (int k = 0; k <= static_cast<int>(Status::interrupted); ++k)
            names.emplace_back(name(static_cast<Status>(k)));
        return names;
    });
    m.def("event_kind_names", [] {
        std::vector<std::string> names;
        for (int k = 0; k <= static_cast<int>(EventKind::end); ++k)
            names.emplace_back(name(static_cast<EventKind>(k)));
        return names;
    });
}

} // namespace filippov::python
