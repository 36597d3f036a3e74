// SPDX-License-Identifier: BSD-3-Clause
// What following orbits over parameters gives, and how far it goes: of branches and of curves.
#pragma once

#include <filippov/continuation/bifurcation.hpp>
#include <filippov/continuation/branch_end.hpp>

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

/// A point of a branch.
struct BranchPoint {
    Cycle cycle;
    Multipliers multipliers;

    bool stable(bool forced) const { return is_stable(multipliers, forced); }
};

/// A bifurcation that was located.
struct SpecialPoint {
    Kind kind{};
    Cycle cycle;             ///< the orbit, with a node where it bifurcates
    std::size_t node = 0;    ///< that node, for sliding bifurcations
    int side = 0;            ///< the boundary of the sliding region that is met: s = side
    std::string word_before; ///< in the direction of the branch
    std::string word_after;
    std::vector<std::pair<std::string, double>> conditions; ///< names and residuals
    /// At the bifurcation, on the side of the word with fewer segments; and on the other side,
    /// where those of a grazing-sliding bifurcation jump.
    Multipliers multipliers, multipliers_child;
    std::string border_class; ///< of a grazing-sliding bifurcation, see border_collision()
    Convergence convergence;
};

/// A branch, from one end to the other.
struct Branch {
    std::vector<BranchPoint> points;
    std::vector<SpecialPoint> special;
    Status status = Status::ok; ///< of the end that went worse
    BranchEnd begin{}, end{};   ///< why it ends there
    long long corrections = 0;  ///< Newton iterations, each one flow with derivatives
};

/// Why a branch ends at its first point or its last, in words.
inline std::string end_message(const Branch& branch, bool first) {
    const BranchEnd end = first ? branch.begin : branch.end;
    std::string text(message(end));
    if (end == BranchEnd::second_bifurcation && !branch.special.empty())
        text +=
            ": " + std::string(name((first ? branch.special.front() : branch.special.back()).kind));
    return text;
}

/// How a branch is followed.
struct BranchSettings {
    double first_step = 0.01; ///< in units of the orbit's size and the bounds' width
    double max_step = 0.05;
    double min_step = 1e-7;
    int max_points = 2000; ///< steps in each direction
    /// May be empty. Called with the number of points so far, in both directions together. (Not
    /// of a curve.)
    std::function<void(std::size_t points)> progress{};
};

namespace detail {

inline void validate(const BranchSettings& s) {
    if (!(s.min_step > 0 && s.min_step <= s.max_step && std::isfinite(s.max_step)))
        refuse("min_step", s.min_step, "expected 0 < min_step <= max_step");
    if (!(s.first_step >= s.min_step && std::isfinite(s.first_step)))
        refuse("first_step", s.first_step, "expected a finite number >= min_step");
    require_positive("max_points", s.max_points);
}
/// With static friction a slide ends in a jump of the field, and no sliding bifurcation is one of
/// the four.
inline void require_continuable(const AnySystem& system, const Vector& p) {
    require_one_surface(system);
    if (const double limit = system.s_max(p); !(limit == 1))
        refuse("s_max", limit, "expected 1, no static friction");
}

/// What came of a step.
enum class StepEnd : unsigned char {
    retry,   ///< a shorter one may do
    goes_on, ///< to the next
    ended,   ///< the branch ends here, and says why
    failed,  ///< no shorter one will do
};

/// True if a branch ends because the caller asks to stop.
inline bool stopped(const AnySystem& system, Branch& branch) {
    if (!system.interrupted())
        return false;
    branch.status = Status::interrupted;
    branch.end = BranchEnd::interrupted;
    return true;
}
/// Steps until `advance(ds)` says that the branch ends.
template <class Advance>
void walk(const AnySystem& system, const BranchSettings& settings, Branch& branch,
          Advance advance) {
    double ds = settings.first_step;
    for (int k = 0; k < settings.max_points; ++k) {
        const bool goes_on = advance(ds);
        if (stopped(system, branch) || !goes_on)
            return;
    }
    branch.status = Status::max_steps;
    branch.end = BranchEnd::max_points;
}
/// One branch of the two directions in which it was followed from a start, the first point of both.
inline Branch joined(const Branch& backward, const Branch& forward) {
    Branch all;
    all.points.assign(backward.points.rbegin(), backward.points.rend());
    for (auto s = backward.special.rbegin(); s != backward.special.rend(); ++s) {
        all.special.push_back(*s);
        std::swap(all.special.back().word_before, all.special.back().word_after);
    }
    const auto first = forward.points.begin();
    if (!forward.points.empty())
        all.points.insert(all.points.end(), first + (all.points.empty() ? 0 : 1),
                          forward.points.end());
    all.special.insert(all.special.end(), forward.special.begin(), forward.special.end());
    all.begin = backward.end;
    all.end = forward.end;
    all.status = backward.status != Status::ok ? backward.status : forward.status;
    all.corrections = backward.corrections + forward.corrections;
    return all;
}

} // namespace detail

} // namespace filippov
