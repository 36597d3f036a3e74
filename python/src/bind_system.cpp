// SPDX-License-Identifier: BSD-3-Clause
#include "bind.hpp"

#include <initializer_list>

namespace filippov::python {

namespace {

using Doubles = Array<double>;

/// Sizes of t (1 or k), x (k, dim) and p; returns k.
std::size_t rows(const Model& model, const Doubles& t, const Doubles& x, const Doubles& p) {
    const Facts& facts = model.facts();
    expect(x.ndim() == 2 && x.shape(1) == facts.dim, "x has shape (k, dim)");
    expect(t.size() == 1 || t.size() == x.shape(0), "t has one entry or k");
    expect(std::size_t(p.size()) == facts.params.size(), "p has one entry a parameter");
    return std::size_t(x.shape(0));
}
void check_side(const Model& model, const std::vector<int>& side) {
    expect(side.size() == std::size_t(model.facts().surfaces), "side has one entry a surface");
    for (const int v : side)
        expect(v >= -1 && v <= 1, "side is -1, 0 or +1");
}
void check_surface(const Model& model, int surface) {
    expect(surface >= 0 && surface < model.facts().surfaces, "surface is an index");
}

py::array_t<double> filled(std::size_t k, std::initializer_list<int> shape, auto fill) {
    std::size_t size = k;
    std::vector<py::ssize_t> full{py::ssize_t(k)};
    for (const int n : shape) {
        size *= std::size_t(n);
        full.push_back(n);
    }
    std::vector<double> out(size);
    fill(std::span<double>(out));
    return as_array(std::move(out), std::move(full));
}

} // namespace

void bind_system(py::module_& m) {
    py::class_<Model, std::shared_ptr<Model>>(m, "Model")
        .def_property_readonly("name", [](const Model& s) { return s.facts().name; })
        .def_property_readonly("state", [](const Model& s) { return s.facts().state; })
        .def_property_readonly("params", [](const Model& s) { return s.facts().params; })
        .def_property_readonly("defaults", [](const Model& s) { return s.facts().defaults; })
        .def_property_readonly("capabilities",
                               [](const Model& s) { return s.facts().capabilities; })
        .def_property_readonly("kinds", [](const Model& s) { return s.facts().kinds; })
        .def_property_readonly("dim", [](const Model& s) { return s.facts().dim; })
        .def_property_readonly("surfaces", [](const Model& s) { return s.facts().surfaces; })
        .def("period",
             [](const Model& s, const Doubles& p) {
                 expect(std::size_t(p.size()) == s.facts().params.size(),
                        "p has one entry a parameter");
                 return s.period(view(p));
             })
        .def("h",
             [](const Model& s, const Doubles& t, const Doubles& x, const Doubles& p) {
                 const std::size_t k = rows(s, t, x, p);
                 return filled(k, {s.facts().surfaces},
                               [&](std::span<double> out) { s.h(view(t), view(x), view(p), out); });
             })
        .def("field",
             [](const Model& s, const Doubles& t, const Doubles& x, const std::vector<int>& side,
                const Doubles& p) {
                 const std::size_t k = rows(s, t, x, p);
                 check_side(s, side);
                 return filled(k, {s.facts().dim}, [&](std::span<double> out) {
                     s.field(view(t), view(x), side, view(p), out);
                 });
             })
        .def("jacobian",
             [](const Model& s, const Doubles& t, const Doubles& x, const std::vector<int>& side,
                const Doubles& p) {
                 const std::size_t k = rows(s, t, x, p);
                 check_side(s, side);
                 return filled(k, {s.facts().dim, s.facts().dim}, [&](std::span<double> out) {
                     s.jacobian(view(t), view(x), side, view(p), out);
                 });
             })
        .def("normal_components",
             [](const Model& s, const Doubles& t, const Doubles& x, int surface,
                const std::vector<int>& side, const Doubles& p) {
                 const std::size_t k = rows(s, t, x, p);
                 check_side(s, side);
                 check_surface(s, surface);
                 return filled(k, {2}, [&](std::span<double> out) {
                     s.normal_components(view(t), view(x), surface, side, view(p), out);
                 });
             })
        .def("project",
             [](const Model& s, const Doubles& t, const Doubles& x, int surface, const Doubles& p) {
                 const std::size_t k = rows(s, t, x, p);
                 check_surface(s, surface);
                 return filled(k, {s.facts().dim}, [&](std::span<double> out) {
                     s.project(view(t), view(x), surface, view(p), out);
                 });
             });

    m.def("models", [] {
        std::vector<std::shared_ptr<Model>> all;
        for (const auto& model : {oscillator(), stiction(), dieci_lopez_2_moments()})
            all.push_back(std::const_pointer_cast<Model>(model)); // the holder type has no const
        return all;
    });
}

} // namespace filippov::python
