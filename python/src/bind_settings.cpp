// SPDX-License-Identifier: BSD-3-Clause
// What runs and pictures are told: each a class made from keywords, with the defaults of C++.
#include "bind.hpp"

#include <filippov/basins/picture.hpp>

#include <string_view>

namespace filippov::python {

namespace {

/// A struct of settings; a keyword that is none of its fields is an AttributeError.
template <class T> py::class_<T> bind_struct(py::module_& m, const char* name) {
    return py::class_<T>(m, name).def(py::init([](const py::kwargs& fields) {
        auto made = std::make_unique<T>();
        const py::object self = py::cast(made.get(), py::return_value_policy::reference);
        for (const auto& [field, value] : fields)
            py::setattr(self, field, value);
        return made;
    }));
}

/// A field that holds an enumerator, in Python its name.
template <class T, class Enum>
void def_named(py::class_<T>& c, const char* field, Enum T::* member, Enum last) {
    c.def_property(
        field, [member](const T& s) { return name(s.*member); },
        [member, last](T& s, std::string_view wanted) {
            int k = 0;
            while (k <= static_cast<int>(last) && name(static_cast<Enum>(k)) != wanted)
                ++k;
            expect(k <= static_cast<int>(last), "expected the name of a value");
            s.*member = static_cast<Enum>(k);
        });
}

} // namespace

void bind_settings(py::module_& m) {
    auto run = bind_struct<RunSettings>(m, "RunSettings");
    run.def_readwrite("rtol", &RunSettings::rtol)
        .def_readwrite("atol", &RunSettings::atol)
        .def_readwrite("max_step", &RunSettings::max_step)
        .def_readwrite("first_step", &RunSettings::first_step)
        .def_readwrite("max_steps", &RunSettings::max_steps)
        .def_readwrite("max_events", &RunSettings::max_events);
    def_named(run, "on_nonunique", &RunSettings::on_nonunique, NonUnique::stay);
    def_named(run, "method", &RunSettings::method, Method::rodas5p);

    bind_struct<BasinSettings>(m, "BasinSettings")
        .def_readwrite("run", &BasinSettings::run)
        .def_readwrite("t0", &BasinSettings::t0)
        .def_property(
            "rest", [](const BasinSettings& s) { return array_of(s.rest); },
            [](BasinSettings& s, const Array<double>& rest) { s.rest = vector_of(rest); })
        .def_readwrite("seeds", &BasinSettings::seeds)
        .def_readwrite("settle", &BasinSettings::settle)
        .def_readwrite("longest", &BasinSettings::longest)
        .def_readwrite("saddle_starts", &BasinSettings::newtons)
        .def_readwrite("max_periods", &BasinSettings::periods)
        .def_readwrite("distance", &BasinSettings::distance)
        .def_readwrite("times", &BasinSettings::times)
        .def_readwrite("audit", &BasinSettings::audit)
        .def_readwrite("escape", &BasinSettings::escape)
        .def_readwrite("seed", &BasinSettings::seed)
        .def_property(
            "threads", [](const BasinSettings& s) { return s.parallel.threads; },
            [](BasinSettings& s, int threads) { s.parallel.threads = threads; });
}

} // namespace filippov::python
