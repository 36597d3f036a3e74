// SPDX-License-Identifier: BSD-3-Clause
// Lyapunov exponents through crossings and slides.
#pragma once

#include <filippov/orbits/dense.hpp>
#include <filippov/orbits/discrete.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace filippov {

/// How exponents are computed. Times are in forcing periods, or in units of time if the system is
/// autonomous.
struct LyapunovSettings {
    double transient = 1000; ///< before the window, >= 0
    double window = 1000;    ///< over which growth is averaged, > 0
    double stretch = 1;      ///< between orthonormalisations, > 0
    int batches = 20;        ///< whose means make the error bar, >= 2
    /// May be empty. Called now and then, with the stretches of transient and window so far.
    std::function<void(std::size_t done, std::size_t total)> progress{};
};

/// Lyapunov exponents over a window.
struct Lyapunov {
    /// dim of them, largest first, per unit of time; 0 exactly for clocks, -inf where slides, or
    /// jumps that set a component, end all
    Vector exponents;
    Vector error;            ///< standard error of each, from the batches' means; 0 of exact ones
    double t_begin = 0;      ///< the window, in units of time: the error holds for it, not for
    double t_end = 0;        ///< what a longer transient would have led to
    long long slides = 0;    ///< modes with a slide entered within the window
    long long stretches = 0; ///< that were averaged
    long long skipped = 0;   ///< stretches left out, since they pass a tangency and have no slope
    Vector x;                ///< state at the end
    Status status = Status::ok;
    std::string message;
};

namespace detail {

/// The loop of `lyapunov`, with its tangent vectors.
class TangentFrame {
public:
    TangentFrame(const AnySystem& system, const Vector& p, const Vector& x0,
                 const LyapunovSettings& settings)
        : system_(system), p_(p), settings_(settings), now_{.x = x0} {
        validate();
        if (system.forced())
            unit_ = require_period(system, p).value;
    }

    Lyapunov run() {
        const auto n_transient = count(settings_.transient), n = count(settings_.window);
        // A tangent vector turns into the leading direction within some stretches, and periods.
        const long long n_aligned = std::min(n_transient, std::max(100LL, count(100)));
        total_ = n_transient + n;
        const Vector x0 = now_.x;
        std::vector<Vector> growth;
        if (settle(double(n_transient - n_aligned) * settings_.stretch)) {
            take_apart(
                discrete_part(Matrix::Identity(system_.dim(), system_.dim()),
                              constant_components(system_, now_.phase * unit_, {x0, now_.x}, p_)));
            const Standing settled = now_;
            // each time a component turns out to be no clock
            while (!follow_window(n_transient, n_aligned, n, growth)) {
                const DiscretePart part = part_;
                now_ = settled;
                take_apart(part);
            }
        }
        summarise(growth);
        result_.x = now_.x;
        return std::move(result_);
    }

private:
    void validate() const {
        const auto at_most = [](double v) { return v <= 1e12; };
        require_point(system_, 0, now_.x, p_, "x0");
        if (!(settings_.transient >= 0 && at_most(settings_.transient)))
            refuse("transient", settings_.transient, "expected a number from 0 to 1e12");
        if (!(settings_.stretch > 0 && at_most(settings_.stretch)))
            refuse("stretch", settings_.stretch, "expected a number > 0");
        if (!(settings_.batches >= 2))
            refuse("batches", settings_.batches, "expected an integer >= 2");
        if (!(settings_.window >= settings_.batches * settings_.stretch &&
              at_most(settings_.window)))
            refuse("window", settings_.window, "expected at least one stretch a batch");
        if (!at_most((settings_.transient + settings_.window) / settings_.stretch))
            refuse("stretch", settings_.stretch, "expected at most 1e12 of them");
    }
    void tell(long long stretches) const {
        if (settings_.progress)
            settings_.progress(std::size_t(stretches), std::size_t(total_));
    }
    long long count(double duration) const { return std::llround(duration / settings_.stretch); }

    /// Where the frame stands.
    struct Standing {
        Vector x;
        Matrix Q{};       ///< orthonormal tangent vectors, shape (rest, m)
        double phase = 0; ///< time in units, within the period if there is one
        bool slides = false;
        /// Of each clock and latch the one that it comes from since the window began; -1: it was
        /// set since.
        std::vector<int> from{};
    };
    /// The frame is one of the components that are no clocks and latches.
    void take_apart(const DiscretePart& part) {
        part_ = part;
        not_a_clock_ = false;
        now_.Q = Matrix::Identity(rest(), rest());
    }
    Eigen::Index rest() const { return Eigen::Index(part_.rest.size()); }

    /// @return false if it has to be done again, with fewer clocks
    bool follow_window(long long n_transient, long long n_aligned, long long n,
                       std::vector<Vector>& growth) {
        bool good = true;
        for (long long k = 0; good && k < n_aligned; ++k) {
            good = advance(nullptr);
            tell(n_transient - n_aligned + k + 1);
        }
        result_.t_begin = unit_ * settings_.stretch * double(n_transient);
        result_.t_end = result_.t_begin;
        const Standing begin = now_;
        if (good)
            measure(n, n_transient, growth);
        // What went before the window is taken from it only if as much goes in it.
        if (result_.status == Status::ok && now_.Q.cols() < rest() && !loses_ && !not_a_clock_) {
            const auto first = std::tuple(now_, result_, growth);
            now_ = begin;
            complete_frame();
            measure(n, n_transient, growth);
            if (result_.status == Status::ok && now_.Q.cols() == std::get<0>(first).Q.cols())
                std::tie(now_, result_, growth) = first; // which began aligned
        }
        return !not_a_clock_;
    }
    /// Follows the window.
    void measure(long long n, long long before, std::vector<Vector>& growth) {
        growth.clear();
        result_.slides = result_.skipped = 0;
        result_.t_end = result_.t_begin;
        loses_ = false;
        now_.from.resize(part_.discrete.size());
        std::iota(now_.from.begin(), now_.from.end(), 0);
        for (long long k = 0; k < n && advance(&growth); ++k) {
            result_.t_end += unit_ * settings_.stretch;
            tell(before + k + 1);
        }
    }

    bool ended(Status status, const std::string& why) {
        if (status == Status::ok)
            return true;
        result_.status = status;
        result_.message = why;
        return false;
    }
    /// Follows the solution, without derivatives, in runs of finite length: their clock stays
    /// exact.
    bool settle(double duration) {
        for (double left = duration; left > 0;) {
            if (system_.interrupted())
                return ended(Status::interrupted, std::string(message(Status::interrupted)));
            const double span = std::min(left, 20 * settings_.stretch), from = now_.phase;
            const History h = system_.run(from * unit_, now_.x, (from + span) * unit_, p_);
            if (!ended(h.status, h.message))
                return false;
            now_.x = h.x;
            move(span);
            left -= span;
            tell(std::llround((duration - left) / settings_.stretch));
        }
        return true;
    }
    /// Time within the period; a forced system does not know more of it.
    void move(double span) {
        now_.phase += span;
        if (system_.forced())
            now_.phase -= std::floor(now_.phase);
    }

    /// Of a stretch.
    struct Growth {
        Vector logs{};
        long long slides = 0;
        bool skipped = false;         ///< a part of it has no derivative
        bool forgot = false;          ///< a part of it has taken a direction, in no time
        int halvings = most_halvings; ///< least of its parts
    };
    static constexpr int most_halvings = 10;

    /// One stretch: the frame goes along and is made orthonormal; its growth is kept.
    bool advance(std::vector<Vector>* growth) {
        Growth found;
        const int parts = 1 << halvings_;
        for (int k = 0; k < parts; ++k)
            if (!follow(settings_.stretch / parts, halvings_, found))
                return false;
        if (!found.forgot)
            halvings_ = found.halvings;
        if (growth != nullptr) {
            result_.slides += found.slides;
            result_.skipped += found.skipped;
            if (!found.skipped)
                growth->push_back(found.logs);
        }
        return true;
    }
    /// A part of a stretch. Where one direction shrinks so much against another that rounding hides
    /// it, the part is followed in halves; so are the stretches that come, unless this was where a
    /// direction ends.
    bool follow(double span, int halvings, Growth& growth) {
        const bool last = halvings == most_halvings;
        const Standing start = now_;
        const Growth grown = growth;
        bool resolved = true;
        if (!take(span, last, growth, resolved))
            return false;
        if (resolved) {
            growth.halvings = std::min(growth.halvings, halvings);
            return true;
        }
        if (last)
            return ended(Status::not_converged,
                         "A direction shrinks too fast for its exponent: take a smaller stretch.");
        now_ = start;
        growth = grown;
        return follow(span / 2, halvings + 1, growth) && follow(span / 2, halvings + 1, growth);
    }
    /// @param forgets   what is hidden by rounding is gone: with jumps, which may forget a speed
    /// @param resolved  false where a direction shrinks too much
    bool take(double span, bool forgets, Growth& growth, bool& resolved) {
        if (system_.interrupted())
            return ended(Status::interrupted, std::string(message(Status::interrupted)));
        const double t0 = now_.phase * unit_;
        const Journey j = system_.journey(
            {.t0 = t0, .x = now_.x, .t_end = t0 + span * unit_, .held = true}, p_, {});
        if (!ended(j.status, j.message))
            return false;
        const int d = system_.dim();
        now_.x = j.end.value.head(d);
        move(span);
        const bool starts_sliding = now_.slides;
        now_.slides = slid_on(j.last, surfaces_) > 0;
        growth.slides += j.slides - (starts_sliding && slid_on(j.first, surfaces_) > 0);
        const Matrix whole = j.end.slope.topLeftCorner(d, d);
        growth.skipped = growth.skipped || !whole.allFinite();
        if (growth.skipped)
            return true;
        if (!pass_clocks(whole))
            return false;
        const Matrix M = part_.of_rest(whole);
        loses_ = loses_ || j.lost > 0;
        if (const Eigen::Index most = std::max<Eigen::Index>(rest() - j.lost, 0);
            now_.Q.cols() > most)
            forget(M, most, growth);
        if (forgets && jumps_)
            if (const Eigen::Index kept = rank(M, 4 * epsilon<double>); kept < now_.Q.cols())
                forget(M, kept, growth);
        if (rank(M, forgets && jumps_ ? 0 : hidden) < now_.Q.cols()) {
            resolved = false;
            return true;
        }
        return orthonormalise(M * now_.Q, growth);
    }
    /// @return false if there are fewer clocks and latches than was thought
    bool pass_clocks(const Matrix& M) {
        const DiscretePart part = discrete_part(M, part_.discrete);
        if (part.discrete.size() < part_.discrete.size()) {
            part_ = part;
            not_a_clock_ = true;
            return false;
        }
        std::vector<int> from = part.from;
        for (int& k : from)
            k = k >= 0 && !now_.from.empty() ? now_.from[std::size_t(k)] : k;
        now_.from = std::move(from);
        return true;
    }
    /// How many of the tangent vectors M keeps at least so much of, against its size.
    Eigen::Index rank(const Matrix& M, double part) const {
        if (now_.Q.cols() == 0)
            return 0;
        return (dense::pivots(M * now_.Q).array() > part * M.norm()).count();
    }
    static constexpr double hidden = 1e-9; ///< its logarithm is right to 1e-7
    /// A slide leaves no more than the directions of the surface: those that M keeps.
    void forget(const Matrix& M, Eigen::Index kept, Growth& growth) {
        const Matrix all = dense::orthogonal_by_size((M * now_.Q).transpose());
        now_.Q = (now_.Q * all.leftCols(kept)).eval();
        growth.forgot = true;
    }
    /// Gives the frame as many vectors as there are directions.
    void complete_frame() {
        const Eigen::Index d = now_.Q.rows(), kept = now_.Q.cols();
        if (kept == d)
            return;
        if (kept == 0) {
            now_.Q = Matrix::Identity(d, d);
            return;
        }
        const Matrix all = dense::orthogonal(now_.Q);
        Matrix full(d, d);
        full << now_.Q, all.rightCols(d - kept);
        now_.Q = full;
    }
    bool orthonormalise(const Matrix& V, Growth& growth) {
        if (V.cols() == 0) {
            growth.logs.resize(0);
            return true;
        }
        const auto [Q, r] = dense::frame(V);
        if (!(r.minCoeff() > 0))
            return ended(Status::not_finite, "A tangent vector became zero or not finite.");
        now_.Q = Q;
        // the vectors that are left, in their order
        const Vector before = growth.logs.size() > 0 ? Vector(growth.logs.head(r.size()))
                                                     : Vector(Vector::Zero(r.size()));
        growth.logs = before + Vector(r.array().log());
        return true;
    }

    /// Means and errors over the stretches that are left.
    void summarise(const std::vector<Vector>& growth) {
        const int d = system_.dim();
        result_.exponents = Vector::Constant(d, -std::numeric_limits<double>::infinity());
        result_.error = Vector::Zero(d);
        result_.stretches = static_cast<long long>(growth.size());
        if (result_.message.empty())
            result_.message = "The window was followed to its end.";
        if (result_.skipped > 0)
            result_.message += " " + std::to_string(result_.skipped) +
                               " stretches, which have no derivative, were left out.";
        if (10 * result_.skipped > result_.stretches + result_.skipped &&
            result_.status == Status::ok)
            result_.status = Status::not_converged;
        const std::size_t batches = std::size_t(settings_.batches);
        if (growth.size() < batches) {
            result_.exponents.setConstant(std::numeric_limits<double>::quiet_NaN());
            result_.error.setConstant(std::numeric_limits<double>::quiet_NaN());
            if (result_.status == Status::ok) {
                result_.status = Status::not_converged;
                result_.message = "Too few stretches have a derivative.";
            }
            return;
        }
        const Eigen::Index m = now_.Q.cols(); // those left at the end
        const double time = unit_ * settings_.stretch;
        Matrix means(m, Eigen::Index(batches));
        Vector total = Vector::Zero(m);
        for (std::size_t b = 0; b < batches; ++b) {
            const std::size_t first = b * growth.size() / batches;
            const std::size_t last = (b + 1) * growth.size() / batches;
            Vector sum = Vector::Zero(m);
            for (std::size_t k = first; k < last; ++k)
                sum += growth[k].head(m);
            means.col(Eigen::Index(b)) = sum / (double(last - first) * time);
            total += sum;
        }
        result_.exponents.head(m) = total / (double(growth.size()) * time);
        for (Eigen::Index i = 0; i < m; ++i) {
            const Vector off = means.row(i).transpose().array() - means.row(i).mean();
            result_.error[i] = std::sqrt(off.squaredNorm() / double(batches * (batches - 1)));
        }
        // a clock that is ahead stays ahead
        const Eigen::Index exact = m + clocks();
        result_.exponents.segment(m, exact - m).setZero();
        sort(exact);
    }
    /// Clocks and latches that no jump has set within the window.
    Eigen::Index clocks() const {
        std::vector<int> from = now_.from;
        std::sort(from.begin(), from.end());
        from.erase(std::unique(from.begin(), from.end()), from.end());
        return std::count_if(from.begin(), from.end(), [](int k) { return k >= 0; });
    }
    /// Over a window too short to align them they may come out of order.
    void sort(Eigen::Index m) {
        std::vector<std::pair<double, double>> all;
        for (Eigen::Index i = 0; i < m; ++i)
            all.emplace_back(result_.exponents[i], result_.error[i]);
        std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a > b; });
        for (Eigen::Index i = 0; i < m; ++i)
            std::tie(result_.exponents[i], result_.error[i]) = all[std::size_t(i)];
    }

    const AnySystem& system_;
    const int surfaces_ = system_.surfaces();
    const bool jumps_ = has_jumps(system_);
    int halvings_ = 0; ///< of a stretch
    const Vector& p_;
    const LyapunovSettings& settings_;
    Standing now_;
    DiscretePart part_{};      ///< which components are clocks and latches
    bool not_a_clock_ = false; ///< one of them turned out to be none
    double unit_ = 1;          ///< of time
    bool loses_ = false;       ///< a slide of the window has taken a direction
    long long total_ = 0;      ///< stretches
    Lyapunov result_;
};

} // namespace detail

/// Lyapunov exponents of the solution from x0 at t = 0.
///
/// Tangent vectors go along with the flow, saltation included, and are made orthonormal after every
/// stretch; exponents are the mean growth over the window. Sliding on the surface takes one
/// direction for good: that exponent is -inf exactly, and no logarithm of zero is taken. So is that
/// of a latch, and of what else jumps set; that of a clock is 0 exactly (see discrete.hpp). The
/// error bar is that of the mean over this window, from batches; what happens after longer
/// transients it cannot know.
/// @error std::invalid_argument for a start, parameters or settings that make no sense; status
///        `not_converged` where a direction shrinks beyond rounding in a thousandth of a stretch
inline Lyapunov lyapunov(const AnySystem& system, const Vector& p, const Vector& x0,
                         const LyapunovSettings& settings = {}) {
    return detail::TangentFrame(system, p, x0, settings).run();
}

} // namespace filippov
