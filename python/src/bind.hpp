// SPDX-License-Identifier: BSD-3-Clause
// What the binding files share.
#pragma once

#include "model.hpp"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <chrono>
#include <csignal>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace filippov::python {

namespace py = pybind11;

template <class T> using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

template <class T> std::span<const T> view(const Array<T>& a) {
    return {a.data(), static_cast<std::size_t>(a.size())};
}
template <class T> std::vector<T> copy(const Array<T>& a) {
    return {a.data(), a.data() + a.size()};
}

/// Hands a vector over to numpy without a copy.
template <class T>
py::array_t<T> as_array(std::vector<T>&& values, std::vector<py::ssize_t> shape) {
    auto owned = std::make_unique<std::vector<T>>(std::move(values));
    T* data = owned->data();
    py::capsule owner(owned.get(), [](void* p) { delete static_cast<std::vector<T>*>(p); });
    owned.release();
    return py::array_t<T>(std::move(shape), data, owner);
}

/// The typed layer passes what fits; this keeps a wrong caller from reading out of bounds.
inline void expect(bool fits, const char* what) {
    if (!fits)
        throw std::invalid_argument(std::string("filippov._core: ") + what);
}

inline py::dict counters_to_dict(const Counters& c) {
    py::dict d;
    d["steps"] = c.steps;
    d["rejected"] = c.rejected;
    d["field"] = c.field;
    d["root_searches"] = c.root_searches;
    d["interpolants"] = c.interpolants;
    d["landings"] = c.landings;
    d["events"] = c.events;
    return d;
}

/// Names of the enumerators up to `last`.
template <class Enum> std::vector<std::string> names_of(Enum last) {
    std::vector<std::string> names;
    for (int k = 0; k <= static_cast<int>(last); ++k)
        names.emplace_back(name(static_cast<Enum>(k)));
    return names;
}

/// The struct in an instance that is whole, else null. (Without a lock: the collector asks.)
template <class T> T* held_by(PyObject* self) {
    const auto* instance = reinterpret_cast<py::detail::instance*>(self);
    return instance->simple_layout && instance->simple_holder_constructed
               ? static_cast<T*>(instance->simple_value_holder[0])
               : nullptr;
}

/// Shows the garbage collector what a result holds: an exception, whose frames hold the result.
template <class T> py::custom_type_setup collected() {
    return py::custom_type_setup([](PyHeapTypeObject* heap) {
        PyTypeObject& type = heap->ht_type;
        type.tp_flags |= Py_TPFLAGS_HAVE_GC;
        type.tp_traverse = [](PyObject* self, visitproc visit, void* arg) {
            Py_VISIT(Py_TYPE(self));
            if (const T* result = held_by<T>(self))
                Py_VISIT(result->raised.ptr());
            return 0;
        };
        type.tp_clear = [](PyObject* self) {
            if (T* result = held_by<T>(self))
                result->raised = py::none();
            return 0;
        };
    });
}

/// A struct of settings or results; a keyword that is none of its fields is an AttributeError.
template <class T> class BoundStruct : public py::class_<T> {
public:
    using py::class_<T>::class_;

    /// A field by its value: a result that is taken out of another stands alone.
    template <class Base, class V> BoundStruct& field(const char* name, V Base::* member) {
        this->def_property(
            name, [member](const T& self) { return self.*member; },
            [member](T& self, V value) { self.*member = std::move(value); });
        return *this;
    }
};
template <class T> BoundStruct<T> bind_struct(py::module_& m, const char* name) {
    const auto bound = [&] {
        if constexpr (requires(T& t) { t.raised; })
            return BoundStruct<T>(m, name, collected<T>());
        else
            return BoundStruct<T>(m, name);
    };
    BoundStruct<T> result = bound();
    result.def(py::init([](const py::kwargs& fields) {
        auto made = std::make_unique<T>();
        const py::object self = py::cast(made.get(), py::return_value_policy::reference);
        for (const auto& [field, value] : fields)
            py::setattr(self, field, value);
        return made;
    }));
    return result;
}

/// Asks Python for signals, at most every 50 ms, and at once if there is one for sure.
class SignalCheck {
public:
    bool operator()() {
        if (raised_)
            return true;
        const auto now = std::chrono::steady_clock::now();
        if (now - last_ < std::chrono::milliseconds(50) && !is_due())
            return false;
        last_ = now;
        is_due() = false;
        const py::gil_scoped_acquire gil;
        if (PyErr_CheckSignals() != 0)
            raised_.emplace();
        return raised_.has_value();
    }
    /// Keeps what a callback raised: to the loop it is a wish to stop, like a signal.
    void raise(py::error_already_set error) { raised_.emplace(std::move(error)); }
    /// The exception that was raised, None if none did.
    py::object raised() const { return raised_ ? py::object(raised_->value()) : py::none(); }
    bool has_raised() const { return raised_.has_value(); }

    /// What a function of the user's raised, which the loop called from this thread: true if it was
    /// Ctrl-C. It comes again as a signal, which the loop asks for and ends with what it has.
    static bool defers(const py::error_already_set& error) {
        if (!error.matches(PyExc_KeyboardInterrupt))
            return false;
        const py::module_ threading = py::module_::import("threading"),
                          signal = py::module_::import("signal");
        const bool comes = threading.attr("current_thread")().is(threading.attr("main_thread")()) &&
                           signal.attr("getsignal")(SIGINT).is(signal.attr("default_int_handler"));
        if (comes)
            PyErr_SetInterrupt();
        is_due() = comes;
        return comes;
    }

private:
    static bool& is_due() {
        thread_local bool due = false;
        return due;
    }

    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
    std::optional<py::error_already_set> raised_;
};

/// A Python callable as the loop's progress; what it raises ends the loop.
inline std::function<void(std::size_t, std::size_t)> progress(const py::object& function,
                                                              SignalCheck& signals) {
    if (function.is_none())
        return {};
    return [&function, &signals](std::size_t done, std::size_t total) {
        const py::gil_scoped_acquire gil;
        try {
            if (!signals.has_raised())
                function(done, total);
        } catch (py::error_already_set& error) {
            signals.raise(std::move(error));
        }
    };
}

/// What analysis takes of a run's settings.
inline Precision precision_of(const RunSettings& s) {
    const RunSettings others;
    expect(s.atol.size() == 1 && s.method == others.method && s.max_step == others.max_step &&
               s.first_step == others.first_step && s.on_nonunique == others.on_nonunique,
           "analysis takes rtol, one atol and max_steps");
    return {.rtol = s.rtol, .atol = s.atol[0], .max_steps = s.max_steps};
}

/// A system for analysis that stops at signals, and one that does not: for what is left to do with
/// results that are finished.
struct Analysis {
    SignalCheck signals;
    std::shared_ptr<const AnySystem> system, unstoppable;

    Analysis(const Model& model, const RunSettings& settings)
        : Analysis(model, precision_of(settings)) {}
    explicit Analysis(const Model& model, Precision precision = {}) {
        unstoppable = model.analysis(precision);
        precision.interrupted = [this] { return signals(); };
        system = model.analysis(precision);
    }
    Analysis(const Analysis&) = delete;
    Analysis& operator=(const Analysis&) = delete;
};

inline Vector vector_of(const Array<double>& a) {
    return Eigen::Map<const Vector>(a.data(), a.size());
}
inline py::array_t<double> array_of(const Vector& v) {
    return as_array(std::vector<double>(v.begin(), v.end()), {v.size()});
}

void bind_basins(py::module_& m);
void bind_cells(py::module_& m);
void bind_diagram(py::module_& m);
void bind_ensemble(py::module_& m);
void bind_formulas(py::module_& m);
void bind_geometry(py::module_& m);
void bind_orbit(py::module_& m);
void bind_maps(py::module_& m);
void bind_run(py::module_& m);
void bind_system(py::module_& m);
void bind_trajectory(py::module_& m);

} // namespace filippov::python
