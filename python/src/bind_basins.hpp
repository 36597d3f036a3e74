// SPDX-License-Identifier: BSD-3-Clause
// What functions of basins share: the picture that they work on, and its attractors.
#pragma once

#include "bind_cells.hpp"

#include <filippov/basins/basins.hpp>

#include <pybind11/complex.h>

#include <algorithm>
#include <complex>
#include <functional>
#include <utility>
#include <vector>

namespace filippov::python {

inline py::array_t<double> rows(const std::vector<Vector>& points, Eigen::Index dim) {
    std::vector<double> all;
    for (const Vector& x : points)
        all.insert(all.end(), x.begin(), x.end());
    return as_array(std::move(all), {py::ssize_t(points.size()), dim});
}
inline std::vector<Vector> points_of(const Array<double>& rows) {
    expect(rows.ndim() == 2, "points have two axes");
    std::vector<Vector> points;
    for (py::ssize_t k = 0; k < rows.shape(0); ++k)
        points.push_back(Eigen::Map<const Vector>(rows.data(k, 0), rows.shape(1)));
    return points;
}
inline std::vector<Matrix> matrices_of(const Array<double>& stack) {
    expect(stack.ndim() == 3 && stack.shape(1) == stack.shape(2), "matrices have three axes");
    std::vector<Matrix> matrices;
    for (py::ssize_t k = 0; k < stack.shape(0); ++k)
        matrices.push_back(
            Eigen::Map<const Matrix>(stack.data(k, 0, 0), stack.shape(1), stack.shape(2)));
    return matrices;
}

/// A StrobeCycle without its slopes: a row a point.
struct StrobeCycleColumns {
    Array<double> points;
    Array<std::complex<double>> multipliers;
    double residual = 0;
};

/// An Attractor: a row a point; it can be pickled.
struct AttractorColumns {
    bool periodic = true;
    Array<double> points; ///< of the cycle, else of the cloud
    Array<std::complex<double>> multipliers;
    double residual = 0, radius = 0;
    Array<double> norms;
};

/// What labels are told of attractors: not their multipliers.
inline std::vector<Attractor> attractors_of(const std::vector<AttractorColumns>& columns) {
    std::vector<Attractor> attractors;
    for (const AttractorColumns& c : columns) {
        Attractor a;
        a.periodic = c.periodic;
        a.radius = c.radius;
        a.norms = matrices_of(c.norms);
        (a.periodic ? a.cycle.points : a.cloud) = points_of(c.points);
        attractors.push_back(std::move(a));
    }
    return attractors;
}

/// A picture of a system, with the settings of its basins. What a call raised, or a signal, ends
/// all later calls too.
class PictureOf {
public:
    PictureOf(const Model& model, py::capsule lanes, const Axes& axes, const Array<double>& p,
              const BasinSettings& settings)
        : lanes_(std::move(lanes)),
          analysis_(model, Precision{.rtol = std::min(settings.run.rtol, 1e-12), .atol = 1e-13}),
          grid_(grid_of(axes)), p_(vector_of(p)), settings_(settings) {
        Parallel& how = settings_.parallel;
        how.cancelled = [this] { return analysis_.signals(); };
        how.progress = [this](std::size_t done, std::size_t total) { show_(done, total); };
    }
    PictureOf(const PictureOf&) = delete;
    PictureOf& operator=(const PictureOf&) = delete;

    /// Calls f() without Python's lock.
    template <class F> auto unlocked(const py::object& show, const F& f) {
        show_ = progress(show, analysis_.signals);
        if (!show_)
            show_ = [](std::size_t, std::size_t) {};
        const py::gil_scoped_release free;
        return f();
    }

    Eigen::Index dim() const { return analysis_.system->dim(); }

    const py::capsule lanes_; ///< kept alive
    Analysis analysis_;
    const CellGrid grid_;
    const Vector p_;
    BasinSettings settings_;

    std::function<void(std::size_t, std::size_t)> show_;
};

/// What takes a picture: `bind_basins` calls it.
void bind_boundary(py::module_& m);

} // namespace filippov::python
