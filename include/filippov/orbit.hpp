// SPDX-License-Identifier: BSD-3-Clause
// Periodic orbits of a word: multiple shooting at the events, and Floquet multipliers.
#pragma once

#include <filippov/word.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>

namespace filippov {

/// A cycle: a word with its nodes. Not necessarily a solution.
struct Cycle {
    Word word;
    int turns = 1;         ///< forcing periods of one cycle; 1 for an autonomous system
    double period = 0;     ///< duration of one cycle
    std::vector<double> t; ///< times of the nodes, increasing; the first is 0 if autonomous
    std::vector<Vector> x; ///< states there
    Vector p;              ///< parameters

    std::size_t size() const { return t.size(); }
    /// When segment i ends.
    double end(std::size_t i) const { return i + 1 < size() ? t[i + 1] : t[0] + period; }
    double duration(std::size_t i) const { return end(i) - t[i]; }
    const Vector& next(std::size_t i) const { return x[(i + 1) % size()]; }
};

/// The equations of the periodic orbits of a word.
///
/// Unknowns are the states and times of the nodes, and parameters. A segment follows its forced
/// mode for a time that is itself unknown, so nothing is located and nothing judged: durations may
/// become negative, slides leave |s| <= 1, and the equations stay smooth where the orbit meets its
/// sliding bifurcations.
///
///   F = (Phi_i(x_i, t_i, t_i+1) - x_i+1,  g_i+1(x_i+1, t_i+1)),   i = 0, ..., n - 1
///
/// z = (x_0, t_0, x_1, t_1, ..., a, b). The last segment ends at t_0 + turns T; if the system is
/// autonomous t_0 is 0 and its place holds the period.
class Shooting {
public:
    /// @param tangent_node  where the field of the side entered is known to be tangent to the
    ///                      surface (an equation of the caller's): h has one root more there
    Shooting(const AnySystem& system, Cycle start, std::array<int, 2> active = {-1, -1},
             int tangent_node = -1)
        : system_(&system), start_(std::move(start)), active_(active), dim_(system.dim()),
          forced_(system.forced()), tangent_node_(tangent_node) {}

    const Word& word() const { return start_.word; }
    int n_active() const { return (active_[0] >= 0) + (active_[1] >= 0); }
    /// Number of equations.
    int rows() const { return int(start_.size()) * (dim_ + 1); }
    int columns() const { return rows() + n_active(); }
    int x_column(std::size_t node) const { return int(node % start_.size()) * (dim_ + 1); }
    /// -1 for the first node of an autonomous system.
    int t_column(std::size_t node) const {
        return node == 0 && !forced_ ? -1 : x_column(node) + dim_;
    }

    Vector pack(const Cycle& c) const {
        Vector z(columns());
        for (std::size_t i = 0; i < c.size(); ++i) {
            z.segment(x_column(i), dim_) = c.x[i];
            z[x_column(i) + dim_] = forced_ ? c.t[i] : i == 0 ? c.period : c.t[i] - c.t[0];
        }
        for (int k = 0; k < n_active(); ++k)
            z[rows() + k] = c.p[active_[std::size_t(k)]];
        return z;
    }
    Cycle unpack(const Vector& z) const {
        Cycle c = start_;
        for (int k = 0; k < n_active(); ++k)
            c.p[active_[std::size_t(k)]] = z[rows() + k];
        for (std::size_t i = 0; i < c.size(); ++i) {
            c.x[i] = z.segment(x_column(i), dim_);
            c.t[i] = z[x_column(i) + dim_];
        }
        if (forced_) {
            c.period = c.turns * system_->period(c.p, {}).value;
        } else {
            c.period = c.t[0];
            c.t[0] = 0;
        }
        return c;
    }
    /// Lengths in which steps of the unknowns are measured: the spread of the orbit, its period,
    /// and for parameters their size.
    Vector scales(const Cycle& c) const {
        Vector size = Vector::Constant(dim_, std::numeric_limits<double>::min());
        // A component may be zero at all events: then what a field makes of it in a while counts,
        // and in a longer one where there is no event, but one point of the orbit.
        const bool one_point = c.word[0].until == Until::phase;
        const double while_ = (one_point ? 0.1 : 1e-3) * std::abs(c.period);
        for (std::size_t i = 0; i < c.size(); ++i) {
            size = size.cwiseMax(c.x[i].cwiseAbs());
            for (const int mode : modes_beside(c, i)) {
                const Vector f = system_->field(mode, c.t[i], c.x[i], c.p);
                if (f.allFinite())
                    size = size.cwiseMax(while_ * f.cwiseAbs());
            }
        }
        Vector scale(columns());
        for (std::size_t i = 0; i < c.size(); ++i) {
            scale.segment(x_column(i), dim_) = size;
            scale[x_column(i) + dim_] = c.period;
        }
        for (int k = 0; k < n_active(); ++k) {
            const double value = std::abs(c.p[active_[std::size_t(k)]]);
            scale[rows() + k] = value > 0 ? value : 1.0;
        }
        return scale;
    }

    struct Value {
        Status status = Status::ok;
        Vector F; ///< shape (rows,)
        Matrix J; ///< dF/dz, shape (rows, columns)
        Matrix K; ///< acts on variations that return multiplied by `turned`; if v was given
        Matrix B; ///< d(K v)/dz, shape (rows, columns), if v was given
    };
    /// @param v       variation of z, shape (columns,)
    /// @param turned  the factor with which it comes back after one turn: 1, or -1
    Value evaluate(const Vector& z, const Vector* v = nullptr, double turned = 1) const {
        const Cycle c = unpack(z);
        const PeriodJet T = system_->period(c.p, {active_, nullptr});
        Value e;
        e.F = Vector::Zero(rows());
        e.J = Matrix::Zero(rows(), columns());
        if (v != nullptr)
            e.K = e.B = e.J;
        for (std::size_t i = 0; i < c.size(); ++i) {
            const Vector local = v != nullptr ? restrict(*v, i, T, turned) : Vector();
            const Directions along{active_, v != nullptr ? &local : nullptr};
            const int row = x_column(i);
            const Jet arc = system_->arc(c.word[i].mode, c.t[i], c.x[i], c.end(i), c.p, along);
            if (arc.status != Status::ok) {
                e.status = arc.status;
                return e;
            }
            e.F.segment(row, dim_) = arc.value - c.next(i);
            scatter(arc, i, i, T, v, turned, row, e);
            for (int k = 0; k < dim_; ++k) {
                e.J(row + k, x_column(i + 1) + k) -= 1;
                if (v != nullptr)
                    e.K(row + k, x_column(i + 1) + k) -= sign_at_end(i, turned);
            }
            add_condition(c, i, T, v, turned, row + dim_, e);
        }
        return e;
    }
    /// The derivatives of all segments, as `floquet` takes them, read off J; nothing if there is
    /// one node alone, where those of start and end are added up.
    std::vector<Jet> arcs_in(const Matrix& J) const {
        std::vector<Jet> arcs(start_.size() > 1 ? start_.size() : 0);
        for (std::size_t i = 0; i < arcs.size(); ++i) {
            const int row = x_column(i);
            arcs[i].slope = Matrix::Zero(dim_, dim_ + 2);
            arcs[i].slope.leftCols(dim_) = J.block(row, x_column(i), dim_, dim_);
            if (t_column(i) >= 0)
                arcs[i].slope.col(dim_) = J.block(row, t_column(i), dim_, 1);
            arcs[i].slope.col(dim_ + 1) = J.block(row, end_column(i), dim_, 1);
        }
        return arcs;
    }
    /// A quantity at a node as one more equation: its value and gradient.
    std::pair<double, Vector> at_node(const Vector& z, std::size_t node, const Quantity& q) const {
        const Cycle c = unpack(z);
        const Jet jet = system_->quantity(q, c.t[node], c.x[node], c.p, {active_, nullptr});
        const auto slope = jet.slope.row(0).transpose();
        Vector gradient = Vector::Zero(columns());
        gradient.segment(x_column(node), dim_) = slope.head(dim_);
        if (t_column(node) >= 0)
            gradient[t_column(node)] = slope[dim_];
        gradient.tail(n_active()) = slope.segment(dim_ + 2, n_active());
        return {jet.value[0], gradient};
    }
    /// How much the duration of segment i, not the last, grows with a step of the unknowns.
    double growth(std::size_t i, const Vector& dz) const {
        return dz[t_column(i + 1)] - (t_column(i) >= 0 ? dz[t_column(i)] : 0.0);
    }

private:
    /// Modes whose fields are defined at node i.
    static std::array<int, 2> modes_beside(const Cycle& c, std::size_t i) {
        if (c.word.surfaces == 1)
            return {-1, 1};
        return {c.word[i + c.size() - 1].mode, c.word[i].mode};
    }
    /// Time at the end of segment i in terms of the unknowns: column and how it depends on a, b.
    int end_column(std::size_t i) const {
        return i + 1 < start_.size() ? t_column(i + 1) : x_column(0) + dim_;
    }
    double turns_after(std::size_t i) const {
        return forced_ && i + 1 == start_.size() ? double(start_.turns) : 0.0;
    }
    /// What a variation is multiplied with where segment i ends: the last one ends at the first
    /// node, one turn later.
    double sign_at_end(std::size_t i, double turned) const {
        return i + 1 == start_.size() ? turned : 1.0;
    }
    /// The same of its time. (The period of an autonomous system does not turn.)
    double sign_of_end_time(std::size_t i, double turned) const {
        return forced_ ? sign_at_end(i, turned) : 1.0;
    }
    /// The part of a variation that segment i sees: (x, t0, t1, a, b).
    Vector restrict(const Vector& v, std::size_t i, const PeriodJet& T, double turned) const {
        Vector local = Vector::Zero(dim_ + 4);
        local.head(dim_) = v.segment(x_column(i), dim_);
        if (t_column(i) >= 0)
            local[dim_] = v[t_column(i)];
        local[dim_ + 1] = sign_of_end_time(i, turned) * v[end_column(i)];
        for (int k = 0; k < n_active(); ++k) {
            local[dim_ + 2 + k] = v[rows() + k];
            local[dim_ + 1] += turns_after(i) * T.slope[std::size_t(k)] * v[rows() + k];
        }
        return local;
    }
    /// Adds a jet in (x_from, t_i, t_end of i, a, b) to rows of the Jacobians.
    void scatter(const Jet& jet, std::size_t from, std::size_t i, const PeriodJet& T,
                 const Vector* v, double turned, int row, Value& e) const {
        scatter(jet.slope, from, i, T, 1, row, e.J);
        if (v == nullptr)
            return;
        scatter(jet.slope, from, i, T, turned, row, e.K);
        scatter(jet.bend, from, i, T, 1, row, e.B);
        for (int k = 0; k < n_active(); ++k)
            for (int l = 0; l < n_active(); ++l)
                e.B.block(row, rows() + k, jet.slope.rows(), 1) +=
                    jet.slope.col(dim_ + 1) *
                    (turns_after(i) * T.bend[std::size_t(k)][std::size_t(l)] * (*v)[rows() + l]);
    }
    void scatter(const Matrix& slope, std::size_t from, std::size_t i, const PeriodJet& T,
                 double turned, int row, Matrix& J) const {
        const auto m = slope.rows();
        const double at_from = from == i ? 1.0 : sign_at_end(i, turned);
        J.block(row, x_column(from), m, dim_) += at_from * slope.leftCols(dim_);
        if (t_column(i) >= 0)
            J.block(row, t_column(i), m, 1) += slope.col(dim_);
        J.block(row, end_column(i), m, 1) += sign_of_end_time(i, turned) * slope.col(dim_ + 1);
        for (int k = 0; k < n_active(); ++k)
            J.block(row, rows() + k, m, 1) +=
                slope.col(dim_ + 2 + k) +
                slope.col(dim_ + 1) * (turns_after(i) * T.slope[std::size_t(k)]);
    }
    /// How many roots h has where segment i starts, if it also ends on the surface.
    int roots_at_start(std::size_t i) const {
        if (start_.word.surfaces > 1)
            return 0;
        const Letter &letter = start_.word[i], &before = start_.word[i + start_.size() - 1];
        if (letter.mode == 0 || letter.until != Until::surface)
            return 0;
        if (before.until == Until::surface)
            return int(i) == tangent_node_ ? 2 : 1;
        const Until own = letter.mode < 0 ? Until::exit_below : Until::exit_above;
        return before.until == own ? 2 : 0;
    }
    void add_condition(const Cycle& c, std::size_t i, const PeriodJet& T, const Vector* v,
                       double turned, int row, Value& e) const {
        const Letter& letter = c.word[i];
        if (letter.until == Until::phase) {
            add_phase(c, i, row, e);
            if (v != nullptr) // linear, and in the variables of the first node alone
                e.K.row(row) = e.J.row(row);
            return;
        }
        if (const int order = roots_at_start(i); order > 0) {
            // A short visit: the root at its start must not be taken for its end.
            const auto rise = system_->rise(letter.mode, order, c.t[i], c.x[i], c.end(i), c.p,
                                            {active_, nullptr});
            if (rise && v == nullptr) {
                e.F[row] = rise->value[0];
                scatter(*rise, i, i, T, nullptr, 1, row, e);
                return;
            }
        }
        // (x, t) of the end: its time is the direction t0 of the quantity
        Vector local;
        if (v != nullptr) {
            local = restrict(*v, i, T, turned);
            local.head(dim_) = sign_at_end(i, turned) * v->segment(x_column(i + 1), dim_);
            std::swap(local[dim_], local[dim_ + 1]);
        }
        Jet jet = system_->quantity(condition(letter), c.end(i), c.next(i), c.p,
                                    {active_, v != nullptr ? &local : nullptr});
        e.F[row] = jet.value[0];
        jet.slope.col(dim_).swap(jet.slope.col(dim_ + 1));
        if (v != nullptr)
            jet.bend.col(dim_).swap(jet.bend.col(dim_ + 1));
        scatter(jet, i + 1, i, T, v, turned, row, e);
    }
    /// A node of an orbit without events: at a fixed time, or in a plane across the flow.
    void add_phase(const Cycle& c, std::size_t i, int row, Value& e) const {
        if (forced_) {
            e.F[row] = c.t[0] - start_.t[0];
            e.J(row, t_column(0)) += 1;
            return;
        }
        const Vector normal = system_->field(c.word[i].mode, 0, start_.x[0], start_.p);
        e.F[row] = normal.dot(c.x[0] - start_.x[0]);
        e.J.block(row, x_column(0), 1, dim_) += normal.transpose();
    }

    const AnySystem* system_;
    Cycle start_;
    std::array<int, 2> active_;
    int dim_;
    bool forced_;
    int tangent_node_;
};

/// Equations as Newton and the continuation see them: fills F and J = dF/dz, false where they
/// cannot be evaluated.
using Equations = std::function<bool(const Vector& z, Vector& F, Matrix& J)>;

/// How Newton's iteration went.
struct Convergence {
    Status status = Status::not_converged;
    int iterations = 0;
    double step = std::numeric_limits<double>::infinity(); ///< last step in units of the scales
    bool ok() const { return status == Status::ok; }
};

/// Newton's iteration on square equations. A step that makes |F| grow much is halved, one of more
/// than a scale is cut to it.
/// @param tolerance  of the step, in units of `scale`
/// @param J          the Jacobian at the result
inline Convergence newton(const Equations& equations, const Vector& scale, Vector& z, Matrix& J,
                          double tolerance = 1e-12, int max_iterations = 25) {
    Convergence c;
    Vector F, trial_F;
    Matrix trial_J;
    if (!equations(z, F, J) || !F.allFinite())
        return c;
    for (; c.iterations < max_iterations;) {
        ++c.iterations;
        const Matrix scaled = J * scale.asDiagonal();
        const Vector dz = -scale.cwiseProduct(scaled.partialPivLu().solve(F));
        const double step = dz.cwiseQuotient(scale).cwiseAbs().maxCoeff();
        if (!(step < std::numeric_limits<double>::infinity()))
            return c;
        // Never further than the orbit is large: segments of absurd length cost absurd time.
        double fraction = std::min(1.0, 1 / step);
        Vector trial;
        bool good = false;
        for (int k = 0; k < 10 && !good; ++k, fraction /= 2) {
            trial = z + fraction * dz;
            good = equations(trial, trial_F, trial_J) && trial_F.allFinite() &&
                   (trial_F.norm() <= 2 * F.norm() || step < 1e-6);
            if (good)
                break;
        }
        if (!good)
            return c;
        // At the floor of rounding steps no longer shrink.
        const bool stalled = step < 1e-9 && step > 0.3 * c.step;
        z = trial;
        F = trial_F;
        J = trial_J;
        c.step = step;
        if (step <= tolerance || stalled) {
            c.status = Status::ok;
            return c;
        }
    }
    return c;
}

/// Newton on a cycle at fixed parameters.
inline Convergence shoot(const AnySystem& system, Cycle& cycle, double tolerance = 1e-12) {
    const Shooting shooting(system, cycle);
    Vector z = shooting.pack(cycle);
    const Equations equations = [&](const Vector& u, Vector& F, Matrix& slope) {
        auto e = shooting.evaluate(u);
        F = std::move(e.F);
        slope = std::move(e.J);
        return e.status == Status::ok;
    };
    Matrix J;
    const Convergence c = newton(equations, shooting.scales(cycle), z, J, tolerance);
    if (c.ok())
        cycle = shooting.unpack(z);
    return c;
}

namespace detail {

/// The derivative of one segment between nodes: acts on deviations (dx, dt) of state and time.
inline Matrix node_map(const AnySystem& system, const Cycle& c, std::size_t i, const Jet& arc) {
    const int d = system.dim();
    Eigen::RowVectorXd delay = Eigen::RowVectorXd::Zero(d + 1); // of the end
    const Matrix A = arc.slope.leftCols(d + 1);
    const Vector f = arc.slope.col(d + 1);
    if (c.word[i].until == Until::phase) {
        if (system.forced())
            delay[d] = 1; // the period later
        else
            delay = -(f.transpose() * A) / f.squaredNorm();
    } else {
        const Jet g = system.quantity(condition(c.word[i]), c.end(i), c.next(i), c.p, {});
        const Eigen::RowVectorXd gx = g.slope.row(0).head(d);
        delay = -(gx * A) / (gx.dot(f) + g.slope(0, d));
    }
    Matrix E(d + 1, d + 1);
    E << A + f * delay, delay;
    return E;
}

/// Orthonormal basis of the directions in which node i can vary.
inline Matrix node_tangent(const AnySystem& system, const Cycle& c, std::size_t node) {
    const int d = system.dim();
    const int m = system.forced() ? d + 1 : d;
    const std::size_t n = c.size();
    const Letter& before = c.word[node + n - 1];
    std::vector<Eigen::RowVectorXd> normals;
    const auto add = [&](const Quantity& q) {
        normals.push_back(system.quantity(q, c.t[node], c.x[node], c.p, {}).slope.row(0).head(m));
    };
    if (before.until == Until::phase) {
        Eigen::RowVectorXd normal = Eigen::RowVectorXd::Zero(m);
        if (system.forced())
            normal[d] = 1;
        else
            normal = system.field(before.mode, 0, c.x[node], c.p).transpose();
        normals.push_back(normal);
    } else {
        add(condition(before));
        for (int j = 0; j < c.word.surfaces; ++j)
            if (mode_entry(before.mode, j) == 0)
                add({Quantity::Kind::h, before.mode, 0, j});
    }
    Matrix C(Eigen::Index(normals.size()), m);
    for (std::size_t k = 0; k < normals.size(); ++k)
        C.row(Eigen::Index(k)) = normals[k] / normals[k].norm();
    const Matrix Q = Eigen::HouseholderQR<Matrix>(C.transpose()).householderQ();
    return Q.rightCols(m - C.rows());
}

/// Eigenvalues of a return map, and the multipliers that are known: 1 of an autonomous system, and
/// zeros for the directions in which a node cannot vary.
inline std::vector<std::complex<double>> sorted_multipliers(const AnySystem& system,
                                                            const Matrix& reduced) {
    std::vector<std::complex<double>> multipliers;
    if (reduced.rows() > 0) {
        const Eigen::VectorXcd values = reduced.eigenvalues();
        multipliers.assign(values.begin(), values.end());
    }
    if (!system.forced())
        multipliers.emplace_back(1);
    multipliers.resize(std::size_t(system.dim()), 0.0);
    std::sort(multipliers.begin(), multipliers.end(), [](const auto& a, const auto& b) {
        return std::abs(a) != std::abs(b) ? std::abs(a) > std::abs(b) : a.imag() > b.imag();
    });
    return multipliers;
}

} // namespace detail

/// Floquet multipliers of a solved cycle, dim of them, largest first.
///
/// They are the eigenvalues of the return map of one node, taken where the node can vary. At the
/// end of a slide that has a dimension less for each surface slid on: so many multipliers are 0
/// exactly, and so is the 1 of an autonomous system.
/// @param arcs  derivatives of the segments, if they are known: see Shooting::arcs_in
inline std::vector<std::complex<double>> floquet(const AnySystem& system, const Cycle& c,
                                                 const std::vector<Jet>& arcs = {}) {
    const std::size_t n = c.size();
    std::size_t first = 0; // the end of a slide, if there is one, on most surfaces at once
    int most = 1;
    for (std::size_t i = 0; i < n; ++i)
        if (const int slides = slid_on(c.word[i].mode, c.word.surfaces); slides >= most) {
            first = (i + 1) % n;
            most = slides;
        }
    const Matrix Q = detail::node_tangent(system, c, first);
    Matrix M = Q;
    const auto m = Q.rows(); // an autonomous system does not care for a deviation of time
    for (std::size_t k = 0; k < n; ++k) {
        const std::size_t i = (first + k) % n;
        const Jet arc =
            arcs.empty() ? system.arc(c.word[i].mode, c.t[i], c.x[i], c.end(i), c.p, {}) : arcs[i];
        M = detail::node_map(system, c, i, arc).topLeftCorner(m, m) * M;
    }
    const Matrix reduced = Q.transpose() * M;
    return detail::sorted_multipliers(system, reduced);
}

/// True if all Floquet multipliers are inside the unit circle, but for the one of an autonomous
/// system that is 1.
inline bool is_stable(const std::vector<std::complex<double>>& multipliers, bool forced) {
    std::ptrdiff_t inside = forced ? 0 : 1;
    for (const auto& m : multipliers)
        inside += std::abs(m) < 1;
    return inside >= std::ptrdiff_t(multipliers.size());
}

/// A periodic orbit, or why there is none.
struct Orbit {
    Cycle cycle;
    std::vector<std::complex<double>> multipliers; ///< dim of them, largest first
    double t_start = 0;                            ///< where the monodromy matrix is taken
    Vector x_start;                                ///< state there
    Matrix monodromy;                              ///< dx(t_start + period)/dx(t_start)
    Convergence convergence;
    Status status = Status::not_converged;
    std::string message; ///< of a failure

    bool stable(bool forced) const { return is_stable(multipliers, forced); }
};

namespace detail {

/// The cycle with a node of its own at time t inside segment i, where nothing happens.
inline Cycle cut(const AnySystem& system, const Cycle& c, std::size_t i, double t, Jet& to_cut) {
    to_cut = system.arc(c.word[i].mode, c.t[i], c.x[i], t, c.p, {});
    Cycle r = c;
    r.word.letters.insert(r.word.letters.begin() + std::ptrdiff_t(i),
                          {c.word[i].mode, Until::phase});
    r.t.insert(r.t.begin() + std::ptrdiff_t(i) + 1, t);
    r.x.insert(r.x.begin() + std::ptrdiff_t(i) + 1, to_cut.value);
    return r;
}

/// Onto the surface along f2 - f1: what a deviation becomes that starts where sliding attracts.
inline Matrix fall(const AnySystem& system, double t, const Vector& x, const Vector& p) {
    const auto rate = [&](int side) {
        return system.quantity({Quantity::Kind::h, side, 1}, t, x, p, {}).value[0];
    };
    const int d = system.dim();
    const Eigen::RowVectorXd normal =
        system.quantity({Quantity::Kind::h, -1, 0}, t, x, p, {}).slope.row(0).head(d);
    return Matrix::Identity(d, d) +
           (system.field(1, t, x, p) - system.field(-1, t, x, p)) * (normal / (rate(-1) - rate(1)));
}

} // namespace detail

/// Where a cycle is said to start, and which segment that is in.
struct CycleStart {
    double t = 0;
    std::size_t in = 0;
};

/// The start of a cycle: time 0, up to whole cycles, which is phase zero of the forcing; the middle
/// of the longest segment if there is none.
inline CycleStart start_of(const AnySystem& system, const Cycle& c) {
    const std::size_t n = c.size();
    CycleStart start;
    if (system.forced()) {
        start.t = c.period * std::ceil(c.t[0] / c.period - 1e-12);
        while (start.in + 1 < n && c.end(start.in) <= start.t)
            ++start.in;
    } else {
        for (std::size_t i = 0; i < n; ++i)
            if (c.duration(i) > c.duration(start.in))
                start.in = i;
        start.t = c.t[start.in] + c.duration(start.in) / 2;
    }
    return start;
}

/// State and monodromy matrix of a solved cycle at its start.
inline void find_start(const AnySystem& system, Orbit& orbit) {
    const Cycle& c = orbit.cycle;
    const std::size_t n = c.size();
    const int d = system.dim();
    const auto [t, in] = start_of(system, c);
    orbit.t_start = t;
    const int mode = c.word[in].mode;
    Jet to_start;
    const Cycle whole = detail::cut(system, c, in, t, to_start);
    orbit.x_start = to_start.value;
    if (c.word.surfaces > 1) {
        const Journey turn =
            system.journey({.t0 = t, .x = orbit.x_start, .t_end = t + c.period}, c.p, {});
        orbit.monodromy = turn.end.slope.topLeftCorner(d, d);
        return;
    }
    // from the start to the end of its segment, round the cycle, and back to the start
    const Jet out = system.arc(mode, t, orbit.x_start, c.end(in), c.p, {});
    Matrix M = detail::node_map(system, whole, in + 1, out);
    Matrix start = Matrix::Zero(d + 1, d);
    start.topRows(d) =
        mode == 0 ? detail::fall(system, t, orbit.x_start, c.p) : Matrix::Identity(d, d);
    M = M * start;
    for (std::size_t k = 1; k < n; ++k) {
        const std::size_t i = (in + k) % n;
        const Jet arc = system.arc(c.word[i].mode, c.t[i], c.x[i], c.end(i), c.p, {});
        M = detail::node_map(system, c, i, arc) * M;
    }
    orbit.monodromy = to_start.slope.leftCols(d + 1) * M;
}

namespace detail {

/// Whether a solved cycle is a solution: followed from its start it comes back, to ten thousand
/// tolerances of its size. (Shooting forces its modes.)
inline bool is_solution(const AnySystem& system, const Orbit& orbit) {
    const Cycle& c = orbit.cycle;
    const double t = orbit.t_start;
    const History turn = system.run(t, orbit.x_start, t + c.period, c.p);
    const Vector scale = Shooting(system, c).scales(c).head(system.dim());
    double growth = 1;
    for (const auto& m : orbit.multipliers)
        growth = std::max(growth, std::abs(m));
    return turn.status == Status::ok && (turn.x - orbit.x_start).cwiseQuotient(scale).norm() <=
                                            (1e4 * system.rtol() + 1e-8) * growth;
}

} // namespace detail

/// A cycle that is an orbit already, whether Newton's iteration converges to it or not: at a fold
/// the shortest step towards the solutions is next to nothing, but the Jacobian is singular.
inline Convergence solved_already(const AnySystem& system, const Cycle& cycle) {
    Convergence c;
    const Shooting shooting(system, cycle);
    const auto e = shooting.evaluate(shooting.pack(cycle));
    if (e.status != Status::ok || !e.F.allFinite() || !e.J.allFinite())
        return c;
    // Unknowns and equations in units of their own: what is singular has no unit.
    Matrix J = e.J * shooting.scales(cycle).asDiagonal();
    const Vector size = J.rowwise().norm().cwiseMax(std::numeric_limits<double>::min());
    J = size.cwiseInverse().asDiagonal() * J;
    Eigen::CompleteOrthogonalDecomposition<Matrix> solver;
    solver.setThreshold(1e-6);
    solver.compute(J);
    c.step = solver.solve(e.F.cwiseQuotient(size)).norm();
    if (c.step < 1e-9)
        c.status = Status::ok;
    return c;
}

/// Newton on a cycle, then all that belongs to an orbit, and a run to see that it is one.
inline Orbit solve_orbit(const AnySystem& system, Cycle cycle) {
    detail::refuse_jumps(system);
    Orbit orbit;
    orbit.convergence = shoot(system, cycle);
    if (!orbit.convergence.ok() && !system.interrupted())
        orbit.convergence = solved_already(system, cycle);
    orbit.cycle = std::move(cycle);
    orbit.status = orbit.convergence.status;
    if (system.interrupted()) {
        orbit.status = Status::interrupted;
        orbit.message = message(Status::interrupted);
        return orbit;
    }
    if (!orbit.convergence.ok()) {
        orbit.message =
            "Newton's iteration on the word " + orbit.cycle.word.string() + " did not converge";
        return orbit;
    }
    orbit.multipliers = floquet(system, orbit.cycle);
    find_start(system, orbit);
    if (!detail::is_solution(system, orbit)) {
        orbit.status = Status::not_converged;
        orbit.message = "the cycle of the word " + orbit.cycle.word.string() +
                        " is no solution here: followed from its start the system goes elsewhere";
    }
    if (system.interrupted()) {
        orbit.status = Status::interrupted;
        orbit.message = message(Status::interrupted);
    }
    return orbit;
}

namespace detail {

/// True if one condition ends the mode: not where two surfaces are reached at once.
inline bool one_condition(const Happening& e, int surfaces) {
    if (surfaces == 1)
        return true;
    if (e.surface < 0 || mode_entry(e.before, e.surface) == mode_entry(e.after, e.surface))
        return false;
    for (int j = 0; j < surfaces; ++j)
        if (const int before = mode_entry(e.before, j);
            j != e.surface && before != 0 && before != mode_entry(e.after, j))
            return false;
    return true;
}

/// Changes of mode one after the other, as they are collected.
struct Changes {
    std::vector<int> modes, at;
    void add(const Happening& e) {
        modes.push_back(e.after);
        at.push_back(std::max(e.surface, 0));
    }
    Word word(int surfaces) const { return Word::of(modes, at, surfaces); }
};

} // namespace detail

/// The cycle that a run of `turns` forcing periods describes, closed or not; none if the modes at
/// its ends differ, it has events and no change of mode fits, or several surfaces are reached at
/// once.
inline std::optional<Cycle> cycle_of(const History& run, double t0, const Vector& x0, int turns,
                                     const Vector& p) {
    Cycle c;
    c.turns = turns;
    c.p = p;
    c.period = run.t - t0;
    detail::Changes changes;
    for (const Happening& e : run.events)
        if (e.before != e.after) {
            if (!changes.modes.empty() && changes.modes.back() != e.before)
                return std::nullopt;
            if (!detail::one_condition(e, run.surfaces))
                return std::nullopt;
            c.t.push_back(e.t);
            c.x.push_back(e.x);
            changes.add(e);
        }
    if (changes.modes.empty()) {
        c.word.letters = {{run.mode, Until::phase}};
        c.word.surfaces = run.surfaces;
        c.t = {t0};
        c.x = {x0};
        return c;
    }
    if (changes.modes.back() != run.mode || run.events.front().before != run.mode)
        return std::nullopt;
    c.word = changes.word(run.surfaces);
    return c;
}

/// The first events of an autonomous run that return: from an event to the first later one with the
/// same change of mode and each component within `closeness` of it, in units of its spread over the
/// events, or but for rounding.
inline std::optional<Cycle> recurrence_of(const History& run, double closeness, const Vector& p) {
    std::vector<const Happening*> changes;
    for (const Happening& e : run.events)
        if (e.before != e.after)
            changes.push_back(&e);
    Vector low = run.x, high = run.x;
    for (const Happening* e : changes) {
        low = low.cwiseMin(e->x);
        high = high.cwiseMax(e->x);
    }
    const Vector allowed =
        closeness * (high - low) + 1e-9 * low.cwiseAbs().cwiseMax(high.cwiseAbs());
    for (std::size_t i = 0; i < changes.size(); ++i)
        for (std::size_t j = i + 1; j < changes.size(); ++j) {
            const Happening &a = *changes[i], &b = *changes[j];
            if (a.before != b.before || a.after != b.after || a.surface != b.surface ||
                !((a.x - b.x).cwiseAbs().array() <= allowed.array()).all())
                continue;
            Cycle c;
            c.p = p;
            c.period = b.t - a.t;
            detail::Changes turn;
            bool known = true;
            for (std::size_t k = i; k < j; ++k) {
                c.t.push_back(changes[k]->t - a.t);
                c.x.push_back(changes[k]->x);
                turn.add(*changes[k]);
                known = known && detail::one_condition(*changes[k], run.surfaces);
            }
            if (!known)
                continue;
            c.word = turn.word(run.surfaces);
            return c;
        }
    return std::nullopt;
}

/// How an orbit is looked for.
struct OrbitSearch {
    double transient = 200;  ///< before it: forcing periods, or time for an autonomous system
    int max_turns = 32;      ///< longest orbit, forcing periods
    double window = 200;     ///< time in which an autonomous orbit has to return
    double closeness = 1e-3; ///< of a return, relative to the orbit's size
};

/// True if a field or h depends on time at this point.
inline bool depends_on_time(const AnySystem& system, double t, const Vector& x, const Vector& p) {
    const int d = system.dim(), surfaces = system.surfaces();
    const auto moves = [d](const Jet& jet) { return jet.slope.col(d).cwiseAbs().maxCoeff() != 0; };
    for (int region = 0; region < 1 << surfaces; ++region) {
        int mode = 0;
        for (int j = surfaces - 1; j >= 0; --j)
            mode = 3 * mode + ((region >> j & 1) != 0 ? 1 : -1);
        if (moves(system.rate(mode, t, x, p, {})))
            return true;
    }
    for (int j = 0; j < surfaces; ++j)
        if (moves(system.quantity({Quantity::Kind::h, -1, 0, j}, t, x, p, {})))
            return true;
    return false;
}

namespace detail {

/// A solved cycle without repetitions of itself.
/// @param tolerance  of times and states, in units of the orbit
inline Cycle shortest(const AnySystem& system, const Cycle& c, double tolerance = 1e-7) {
    const std::size_t n = c.size();
    const Vector scale = Shooting(system, c).scales(c).head(system.dim());
    const auto near = [&](const Vector& a, const Vector& b) {
        return (a - b).cwiseQuotient(scale).norm() < tolerance;
    };
    if (n == 1 && c.word[0].until == Until::phase) {
        for (int turns = 1; turns < c.turns; ++turns) {
            Cycle one = c;
            one.turns = turns;
            one.period = c.period * turns / c.turns;
            if (c.turns % turns == 0 &&
                near(system.arc(c.word[0].mode, c.t[0], c.x[0], one.end(0), c.p, {}).value, c.x[0]))
                return one;
        }
        return c;
    }
    for (std::size_t part = 1; part < n; ++part) {
        const auto times = int(n / part);
        if (n % part != 0 || (system.forced() && c.turns % times != 0))
            continue;
        const double period = c.period / times;
        bool same = true;
        for (std::size_t i = 0; same && i < n; ++i) {
            const std::size_t j = (i + part) % n;
            same = c.word[i] == c.word[j] &&
                   std::abs(std::remainder(c.t[j] - c.t[i] - period, c.period)) <
                       tolerance * c.period &&
                   near(c.x[j], c.x[i]);
        }
        if (!same)
            continue;
        Cycle one = c;
        one.word.letters.resize(part);
        one.t.resize(part);
        one.x.resize(part);
        one.period = period;
        if (system.forced())
            one.turns = c.turns / times;
        return one;
    }
    return c;
}

/// The orbit of the least period that Newton's iteration finds from a cycle.
inline Orbit solve_shortest(const AnySystem& system, const Cycle& cycle) {
    const Orbit orbit = solve_orbit(system, cycle);
    if (orbit.status != Status::ok)
        return orbit;
    const Cycle one = shortest(system, orbit.cycle);
    return one.period < 0.9 * orbit.cycle.period ? solve_orbit(system, one) : orbit;
}

/// The orbit that a solution comes back to from x at phase zero: the first stable one, else the
/// first.
inline Orbit orbit_from(const AnySystem& system, const Vector& p, Vector x,
                        const OrbitSearch& search) {
    Orbit found;
    found.status = Status::not_converged;
    if (!system.forced()) {
        const History window = system.run(0, x, search.window, p);
        found.status = window.status;
        found.message = window.message;
        if (window.status != Status::ok)
            return found;
        if (const auto cycle = recurrence_of(window, search.closeness, p))
            return solve_shortest(system, *cycle);
        found.status = Status::not_converged;
        found.message = "no event returns in the window";
        return found;
    }
    found.message = "no periodic orbit within max_turns forcing periods";
    const double T = system.period(p, {}).value;
    const Vector start = x;
    Vector size = x.cwiseAbs();
    for (int turns = 1; turns <= search.max_turns; ++turns) {
        const History turn = system.run(0, x, T, p);
        if (turn.status != Status::ok) {
            found.status = turn.status;
            found.message = turn.message;
            return found;
        }
        x = turn.x;
        size = size.cwiseMax(x.cwiseAbs());
        for (const Happening& e : turn.events)
            size = size.cwiseMax(e.x.cwiseAbs());
        if (!((x - start).norm() <= search.closeness * size.norm()))
            continue;
        const History whole = system.run(0, x, turns * T, p);
        const auto cycle = cycle_of(whole, 0, x, turns, p);
        if (!cycle)
            continue;
        Orbit orbit = solve_shortest(system, *cycle);
        if (orbit.status != Status::ok)
            continue;
        if (orbit.stable(true))
            return orbit;
        if (found.status != Status::ok)
            found = std::move(orbit);
    }
    return found;
}

} // namespace detail

/// The orbit that the solution from x0 at t0 = 0 settles on.
///
/// Beside an unstable orbit a solution may linger: it is followed longer then, up to sixteen times
/// as long, and the unstable one is the answer if it is still there.
inline Orbit settle(const AnySystem& system, const Vector& p, const Vector& x0,
                    const OrbitSearch& search = {}) {
    detail::refuse_jumps(system);
    Orbit found;
    if (!system.forced() && depends_on_time(system, 0.1, x0, p)) {
        found.status = Status::not_converged;
        found.message = "the system depends on time and gives no period";
        return found;
    }
    const double unit = system.forced() ? system.period(p, {}).value : 1.0;
    Vector x = x0;
    double transient = search.transient;
    for (int attempt = 0; attempt < 3; ++attempt) {
        const History first = system.run(0, x, transient * unit, p);
        x = first.x;
        Orbit orbit;
        orbit.status = first.status;
        orbit.message = first.message;
        if (first.status == Status::ok)
            orbit = detail::orbit_from(system, p, x, search);
        const bool ok = orbit.status == Status::ok, stable = ok && orbit.stable(system.forced());
        if (attempt == 0 || stable || orbit.status == Status::interrupted)
            found = std::move(orbit);
        if (!ok || stable)
            break;
        transient = 4 * std::max(transient, 1.0);
    }
    return found;
}

/// The orbit near the solution from x0 at t0 (phase zero if 0), stable or not: `turns` forcing
/// periods long, or the first return of an event of an autonomous system.
inline Orbit orbit_near(const AnySystem& system, const Vector& p, double t0, const Vector& x0,
                        int turns, const OrbitSearch& search = {}) {
    detail::refuse_jumps(system);
    Orbit none;
    const double T = system.period(p, {}).value;
    const double span = system.forced() ? turns * T : search.window;
    std::optional<Cycle> cycle;
    Vector x = x0;
    // A guess beside the surface may come round in another mode, and its image in the right one.
    for (int k = 0; k < 3 && !cycle; ++k) {
        const History run = system.run(t0, x, t0 + span, p);
        none.status = run.status;
        none.message = run.message;
        if (run.status != Status::ok)
            return none;
        cycle = system.forced() ? cycle_of(run, t0, x, turns, p) : recurrence_of(run, 0.1, p);
        x = run.x;
    }
    if (!cycle) {
        none.status = Status::not_converged;
        none.message = "the run from the guess does not come round to the mode it starts in";
        return none;
    }
    return solve_orbit(system, *cycle);
}

} // namespace filippov
