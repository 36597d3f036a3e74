// SPDX-License-Identifier: BSD-3-Clause
// A buck converter, fed with E where h > 0: its voltage and current. What h compares is up to a
// test.
#pragma once

#include <filippov/system.hpp>

/// @tparam P  parameters, of which E is the first
template <int P> struct Converter {
    static constexpr int dim = 2;

    template <filippov::Scalar S>
    filippov::Vec<S, 2> f1(const S&, const filippov::Vec<S, 2>& x,
                           const filippov::Vec<S, P>&) const {
        return fed(x, S(0));
    }
    template <filippov::Scalar S>
    filippov::Vec<S, 2> f2(const S&, const filippov::Vec<S, 2>& x,
                           const filippov::Vec<S, P>& p) const {
        return fed(x, p[0]);
    }
    template <filippov::Scalar S> S period(const filippov::Vec<S, P>&) const { return S(0.4); }

private:
    template <filippov::Scalar S>
    static filippov::Vec<S, 2> fed(const filippov::Vec<S, 2>& x, const S& u) {
        return {(x[1] - x[0] / S(22)) / S(0.047), (u - x[0]) / S(20)};
    }
};
