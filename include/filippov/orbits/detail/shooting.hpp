// SPDX-License-Identifier: BSD-3-Clause
// Cycles of a word, the equations of periodic orbits by multiple shooting at the events, and
// Newton's iteration.
#pragma once

#include <filippov/orbits/dense.hpp>
#include <filippov/orbits/word.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
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

namespace detail {

/// The same cycle, read from node k on.
inline Cycle rotated(const Cycle& c, std::size_t k) {
    Cycle r = c;
    const std::size_t n = c.size();
    for (std::size_t i = 0; i < n; ++i) {
        const std::size_t j = (k + i) % n;
        r.word.letters[i] = c.word.letters[j];
        r.x[i] = c.x[j];
        r.t[i] = c.t[j] + (k + i >= n ? c.period : 0.0);
    }
    return r;
}

/// A cycle that comes from outside: as many letters and states as times, states of the system's.
inline void require_cycle(const AnySystem& system, const Cycle& c) {
    if (c.t.empty())
        refuse("cycle.t.size()", 0, "expected at least one node");
    if (c.word.letters.size() != c.t.size())
        refuse("cycle.word.letters.size()", double(c.word.letters.size()),
               "expected one letter a node");
    if (c.x.size() != c.t.size())
        refuse("cycle.x.size()", double(c.x.size()), "expected one state a node");
    for (std::size_t i = 0; i < c.x.size(); ++i)
        if (c.x[i].size() != system.dim())
            refuse("cycle.x[" + std::to_string(i) + "].size()", double(c.x[i].size()),
                   "expected dim entries");
}

} // namespace detail

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
          forced_(system.forced()), tangent_node_(tangent_node) {
        detail::require_cycle(system, start_);
    }

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
        // A component may be zero at all events: the orbit is seen between them, too, and what a
        // field makes of it in a while counts.
        for (std::size_t i = 0; i < c.size(); ++i) {
            size = size.cwiseMax(c.x[i].cwiseAbs());
            for (const int mode : modes_beside(c, i)) {
                const Vector f = system_->field(mode, c.t[i], c.x[i], c.p);
                if (f.allFinite())
                    size = size.cwiseMax(1e-3 * std::abs(c.period) * f.cwiseAbs());
            }
            for (const double share : {0.25, 0.5, 0.75}) {
                const double t = c.t[i] + share * c.duration(i);
                const Jet arc = system_->arc(c.word[i].mode, c.t[i], c.x[i], t, c.p, {});
                if (arc.status == Status::ok && arc.value.allFinite())
                    size = size.cwiseMax(arc.value.cwiseAbs());
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
    /// The period of an autonomous orbit in the unknowns, in a step of them, in their lengths.
    double period_in(const Vector& z) const { return z[dim_]; }
    /// A step of the unknowns but for that of the times.
    Vector without_times(Vector dz) const {
        for (std::size_t i = 0; i < start_.size(); ++i)
            dz[x_column(i) + dim_] = 0;
        return dz;
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

/// The equations of a word. The shooting has to outlive them.
inline Equations equations_of(const Shooting& shooting) {
    return [&shooting](const Vector& z, Vector& F, Matrix& J) {
        auto e = shooting.evaluate(z);
        F = std::move(e.F);
        J = std::move(e.J);
        return e.status == Status::ok;
    };
}

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
        const Vector dz = -scale.cwiseProduct(dense::solve(scaled, F));
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
    Matrix J;
    const Convergence c = newton(equations_of(shooting), shooting.scales(cycle), z, J, tolerance);
    if (c.ok())
        cycle = shooting.unpack(z);
    return c;
}

} // namespace filippov
