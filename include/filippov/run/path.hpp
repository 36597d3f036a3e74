// SPDX-License-Identifier: BSD-3-Clause
// The path of a step, whatever made it: what guards, landings and observers see of one.
#pragma once

#include <filippov/methods/runge_kutta.hpp>

namespace filippov {

/// A path as a DensePiece keeps it.
template <class S, int N> struct StoredPath {
    Interpolant<S, N, 8>& polynomial;
    bool& closed_form;
};

/// The path of a step, from where a run is.
template <class S, int N> class Path {
public:
    using X = Vec<S, N>;

    S dt{}; ///< signed length
    X x1;   ///< its end

    /// The state at theta in [0, 1] of it. The interpolant behind it is built at the first call.
    virtual X operator()(const S& theta) = 0;
    virtual void store(const StoredPath<S, N>& kept) = 0;

protected:
    Path() = default;
    ~Path() = default;
    Path(const Path&) = default;
    Path& operator=(const Path&) = default;
};

/// What is known of a path that was tried.
struct PathKind {
    bool by_method;    ///< else the system knows it
    bool exact_probes; ///< guards were probed at its samples
    bool vouched;      ///< the system says that it is short enough to show every swing of s
};

/// A path that can be made to end where an event is.
template <class S, int N> class TriedPath : public Path<S, N> {
public:
    using typename Path<S, N>::X;

    const PathKind kind;

    /// Takes the step again, with another length.
    virtual void shorten(const S& step) = 0;
    /// Moves the end by a Taylor step.
    virtual void nudge(const S& delta) = 0;
    /// Bound on the error of that, in units of the tolerance.
    virtual S nudge_error(const S& delta) const = 0;
    /// The field where it ends.
    virtual X end_field() const = 0;
    bool finite() const { return all_finite<S, N>(this->x1); }

protected:
    explicit TriedPath(const PathKind& known) : kind(known) {}
    ~TriedPath() = default;
};

} // namespace filippov
