// SPDX-License-Identifier: BSD-3-Clause
// What runs are told, and words for what they say.
#include "bind.hpp"

#include <filippov/core/status.hpp>
#include <filippov/run/event.hpp>

#include <algorithm>

namespace filippov::python {

namespace {

/// A field that holds an enumerator, in Python its name.
template <class T, class Enum>
void def_named(py::class_<T>& c, const char* field, Enum T::* member, Enum last) {
    c.def_property(
        field, [member](const T& s) { return name(s.*member); },
        [member, last, field](T& s, const std::string& wanted) {
            const std::vector<std::string> names = names_of(last);
            const auto found = std::find(names.begin(), names.end(), wanted);
            if (found == names.end())
                expect(false, (std::string(field) + " = " + wanted + ": no such name").c_str());
            s.*member = static_cast<Enum>(found - names.begin());
        });
}

} // namespace

void bind_run(py::module_& m) {
    m.def("status_names", [] { return names_of(Status::interrupted); });
    m.def("event_kind_names", [] { return names_of(EventKind::end); });

    auto run = bind_struct<RunSettings>(m, "RunSettings");
    run.def_readwrite("rtol", &RunSettings::rtol)
        .def_readwrite("atol", &RunSettings::atol)
        .def_readwrite("max_step", &RunSettings::max_step)
        .def_readwrite("first_step", &RunSettings::first_step)
        .def_readwrite("max_steps", &RunSettings::max_steps)
        .def_readwrite("max_events", &RunSettings::max_events);
    def_named(run, "on_nonunique", &RunSettings::on_nonunique, NonUnique::stay);
    def_named(run, "method", &RunSettings::method, Method::rodas5p);
}

} // namespace filippov::python
