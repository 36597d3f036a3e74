// SPDX-License-Identifier: BSD-3-Clause
// Functions of which only values are known: compiled elsewhere, or another language's.
#pragma once

#include <filippov/core/dual.hpp>
#include <filippov/core/taylor.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace filippov {

/// out = f(t, x, p). Where derivatives are needed and not given, they are differences over five
/// points: first ones are good to about 1e-12 of the function's size, second ones to 1e-9, third
/// ones to 1e-6. Where the function ends (is not finite) on one side, the points are on the other,
/// and first ones good to 1e-11.
struct External {
    using Function = std::function<void(double t, const double* x, const double* p, double* out)>;

    std::string name;
    int dim = 0;     ///< components of x
    int params = 0;  ///< of p
    int outputs = 0; ///< of f
    Function value;
    /// df_i/dx_j at [i dim + j], as a function of its own; may be null.
    std::shared_ptr<const External> jacobian;
    /// Typical sizes of time, the components and the parameters, all > 0, on which the function
    /// changes: differences take steps of a thousandth of them.
    std::vector<double> scale;

    int inputs() const { return 1 + dim + params; }
};

/// Refuses a function that could not be called, or differentiated without reading beyond its sizes.
inline void validate(const External* f) {
    const auto demand = [](bool holds, const std::string& expectation) {
        if (!holds)
            throw std::invalid_argument("filippov: external function: expected " + expectation);
    };
    demand(f != nullptr, "one, not null");
    demand(bool(f->value), "a value(t, x, p, out), not an empty one");
    demand(f->dim >= 0 && f->params >= 0 && f->outputs > 0, "dim, params >= 0 and outputs > 0");
    demand(f->scale.size() == std::size_t(f->inputs()),
           "scale with one entry for time, each component and each parameter");
    for (const double size : f->scale)
        demand(size > 0 && size < std::numeric_limits<double>::infinity(),
               "finite numbers > 0 in scale");
    if (f->jacobian) {
        validate(f->jacobian.get());
        demand(f->jacobian->dim == f->dim && f->jacobian->params == f->params &&
                   f->jacobian->outputs == f->outputs * f->dim,
               "a jacobian of the same inputs with outputs * dim outputs");
    }
}

/// An external function of any scalar.
/// @param out  `outputs` numbers
template <class S> void evaluate(const External& f, const S& t, const S* x, const S* p, S* out);

namespace detail {

/// Time, state and parameters in a row.
template <class T> using Inputs = std::vector<T>;

template <class T> void evaluate(const External& f, const Inputs<T>& at, T* out) {
    filippov::evaluate(f, at[0], at.data() + 1, at.data() + 1 + f.dim, out);
}

/// Steps of differences, of the scale. Five points are best a little above the fifth root of the
/// rounding, and a power of two adds none of its own.
inline constexpr double difference_step = 0x1p-10;

inline double size_of_input(const External& f, int i, double value) {
    // beyond a million of it rounding would show
    return std::max(f.scale[std::size_t(i)], 1e-6 * std::abs(value));
}
/// What is not written is not a number.
template <class T> std::vector<T> unwritten(int n) {
    return std::vector<T>(std::size_t(n), T(std::numeric_limits<double>::quiet_NaN()));
}

inline bool all_parts_finite(double x) { return std::isfinite(x); }
template <class T, int K> bool all_parts_finite(const Dual<T, K>& x) {
    return all_parts_finite(x.v) &&
           std::ranges::all_of(x.d, [](const T& part) { return all_parts_finite(part); });
}
template <class T, int K> bool all_parts_finite(const Taylor<T, K>& x) {
    return std::ranges::all_of(x.c, [](const T& part) { return all_parts_finite(part); });
}

/// Coefficients 1 to 4 of the polynomial through five values, in powers of their distance.
template <class T> struct Quartic {
    std::array<T, 4> c;
    bool finite = false;

    /// Of values at -2 ... 2.
    static Quartic about(const T& a, const T& b, const T& at, const T& d, const T& e) {
        return made(
            {(T(8) * (d - b) - (e - a)) / T(12), (T(16) * (d + b) - (e + a) - T(30) * at) / T(24),
             ((e - a) - T(2) * (d - b)) / T(12), ((e + a) - T(4) * (d + b) + T(6) * at) / T(24)});
    }
    /// Of values at 0, side, ..., 4 side, for a side of 1 or -1.
    static Quartic beside(const T& at, const T& b, const T& c, const T& d, const T& e, int side) {
        const T odd(side);
        return made({odd * (T(48) * b - T(36) * c + T(16) * d - T(3) * e - T(25) * at) / T(12),
                     (T(114) * c - T(104) * b - T(56) * d + T(11) * e + T(35) * at) / T(24),
                     odd * (T(18) * b - T(24) * c + T(14) * d - T(3) * e - T(5) * at) / T(12),
                     (T(6) * c - T(4) * b - T(4) * d + e + at) / T(24)});
    }

private:
    static Quartic made(const std::array<T, 4>& c) {
        return {c, std::ranges::all_of(c, [](const T& part) { return all_parts_finite(part); })};
    }
};

/// The quartics of f along a curve through five points: two on either side, or four on one where f
/// ends on the other (at a wall beyond the surface, say).
/// @param at     f at 0
/// @param curve  `Inputs<T>` at so many steps
template <class T, class Curve>
std::vector<Quartic<T>> quartics(const External& f, const std::vector<T>& at, const Curve& curve) {
    const auto sampled = [&](int steps) {
        auto sample = unwritten<T>(f.outputs);
        evaluate(f, curve(steps), sample.data());
        return sample;
    };
    std::vector<Quartic<T>> all(at.size());
    std::array<std::vector<T>, 4> s;
    for (std::size_t m = 0; m < s.size(); ++m)
        s[m] = sampled(std::array{-2, -1, 1, 2}[m]);
    for (std::size_t i = 0; i < all.size(); ++i)
        all[i] = Quartic<T>::about(s[0][i], s[1][i], at[i], s[2][i], s[3][i]);
    for (const int side : {-1, 1}) {
        const auto ends = [&](std::size_t i) { return !all[i].finite && all_parts_finite(at[i]); };
        bool any = false;
        for (std::size_t i = 0; i < all.size(); ++i)
            any = any || ends(i);
        if (!any)
            break;
        for (std::size_t m = 0; m < s.size(); ++m)
            s[m] = sampled(side * int(m + 1));
        for (std::size_t i = 0; i < all.size(); ++i)
            if (ends(i)) {
                const auto there =
                    Quartic<T>::beside(at[i], s[0][i], s[1][i], s[2][i], s[3][i], side);
                all[i] = there.finite ? there : all[i];
            }
    }
    return all;
}

/// The derivative of f along a direction, `outputs` numbers.
/// @param here  f there
template <class T>
std::vector<T> derivative_along(const External& f, const Inputs<T>& at, Inputs<T> along,
                                const std::vector<T>& here) {
    std::vector<T> slope(std::size_t(f.outputs), T(0));
    if (f.jacobian) {
        auto jacobian = unwritten<T>(f.outputs * f.dim);
        evaluate(*f.jacobian, at, jacobian.data());
        for (int i = 0; i < f.outputs; ++i)
            for (int j = 0; j < f.dim; ++j)
                slope[std::size_t(i)] +=
                    jacobian[std::size_t(i * f.dim + j)] * along[std::size_t(1 + j)];
        std::fill_n(along.begin() + 1, f.dim, T(0));
    }
    double size = 0;
    for (int i = 0; i < f.inputs(); ++i) {
        const auto k = std::size_t(i);
        const double part =
            std::abs(double(value_of(along[k]))) / size_of_input(f, i, double(value_of(at[k])));
        size = size >= part ? size : part;
    }
    if (size == 0)
        return slope;
    const double step = difference_step / size;
    const auto line = [&](int steps) {
        Inputs<T> shifted = at;
        for (std::size_t i = 0; i < at.size(); ++i)
            shifted[i] += T(steps * step) * along[i];
        return shifted;
    };
    const auto all = quartics(f, here, line);
    for (std::size_t i = 0; i < slope.size(); ++i)
        slope[i] += all[i].c[0] / T(step);
    return slope;
}

template <class T, int K>
void evaluate_series(const External& f, const Inputs<Dual<T, K>>& at, Dual<T, K>* out) {
    Inputs<T> value, along(at.size(), T(0));
    for (const auto& input : at)
        value.push_back(input.v);
    auto result = unwritten<T>(f.outputs);
    evaluate(f, value, result.data());
    std::copy(result.begin(), result.end(), out);
    for (std::size_t k = 0; k < std::size_t(K); ++k) {
        for (std::size_t i = 0; i < at.size(); ++i)
            along[i] = at[i].d[k];
        const std::vector<T> slope = derivative_along(f, value, along, result);
        for (std::size_t i = 0; i < slope.size(); ++i)
            out[i].d[k] = slope[i];
    }
}

/// The polynomial through five points of a curve; what would be beyond its order is NaN.
template <class T, int K>
void evaluate_series(const External& f, const Inputs<Taylor<T, K>>& at, Taylor<T, K>* out) {
    if constexpr (K == 1) { // a dual number
        Inputs<Dual<T, 1>> same;
        for (const auto& input : at) {
            same.emplace_back(input.c[0]);
            same.back().d[0] = input.c[1];
        }
        auto result = unwritten<Dual<T, 1>>(f.outputs);
        evaluate_series(f, same, result.data());
        for (std::size_t i = 0; i < result.size(); ++i) {
            out[i].c[0] = result[i].v;
            out[i].c[1] = result[i].d[0];
        }
        return;
    }
    double step = std::numeric_limits<double>::infinity();
    for (int i = 0; i < f.inputs(); ++i)
        for (int k = 1; k <= K; ++k) {
            const auto& c = at[std::size_t(i)].c;
            const double size = size_of_input(f, i, double(value_of(c[0]))),
                         part = std::abs(double(value_of(c[std::size_t(k)])));
            if (part > 0)
                step = std::min(step, std::pow(difference_step * size / part, 1.0 / k));
        }
    Inputs<T> value;
    for (const auto& input : at)
        value.push_back(input.c[0]);
    auto here = unwritten<T>(f.outputs);
    evaluate(f, value, here.data());
    std::copy(here.begin(), here.end(), out);
    if (!(step < std::numeric_limits<double>::infinity())) // nothing moves
        return;
    const auto curve = [&](int steps) {
        const T tau(steps * step);
        Inputs<T> shifted;
        for (const auto& input : at) {
            T sum = input.c[std::size_t(K)];
            for (int k = K - 1; k >= 0; --k)
                sum = input.c[std::size_t(k)] + tau * sum;
            shifted.push_back(sum);
        }
        return shifted;
    };
    const auto all = quartics(f, here, curve);
    for (std::size_t i = 0; i < all.size(); ++i) {
        double power = 1;
        for (std::size_t k = 1; k <= std::size_t(K); ++k) {
            power *= step;
            out[i].c[k] = k <= all[i].c.size() ? T(all[i].c[k - 1] / T(power))
                                               : T(std::numeric_limits<double>::quiet_NaN());
        }
    }
}

} // namespace detail

template <class S> void evaluate(const External& f, const S& t, const S* x, const S* p, S* out) {
    if constexpr (std::same_as<S, double>) {
        f.value(t, x, p, out);
    } else if constexpr (is_wide<S> || std::floating_point<S>) {
        constexpr int width = [] {
            if constexpr (is_wide<S>)
                return int(S::width);
            else
                return 1;
        }();
        detail::Inputs<double> at(std::size_t(f.inputs()));
        auto value = detail::unwritten<double>(f.outputs);
        for (int l = 0; l < width; ++l) {
            const auto one = [l](const S& v) {
                if constexpr (is_wide<S>)
                    return double(v[l]);
                else
                    return double(v);
            };
            at[0] = one(t);
            for (int i = 0; i < f.dim; ++i)
                at[std::size_t(1 + i)] = one(x[i]);
            for (int i = 0; i < f.params; ++i)
                at[std::size_t(1 + f.dim + i)] = one(p[i]);
            detail::evaluate(f, at, value.data());
            for (int i = 0; i < f.outputs; ++i)
                if constexpr (is_wide<S>)
                    out[i].set(l, value[std::size_t(i)]);
                else
                    out[i] = S(value[std::size_t(i)]);
        }
    } else {
        detail::Inputs<S> at{t};
        at.insert(at.end(), x, x + f.dim);
        at.insert(at.end(), p, p + f.params);
        detail::evaluate_series(f, at, out);
    }
}

/// The partial derivative of an external function by one of its inputs: time, the components, the
/// parameters, in this order.
inline std::shared_ptr<const External> partial(const std::shared_ptr<const External>& f,
                                               int input) {
    auto d = std::make_shared<External>(*f);
    d->jacobian = nullptr;
    d->value = [f, input](double t, const double* x, const double* p, double* out) {
        detail::Inputs<double> at{t}, along(std::size_t(f->inputs()), 0.0);
        at.insert(at.end(), x, x + f->dim);
        at.insert(at.end(), p, p + f->params);
        along[std::size_t(input)] = 1;
        auto here = detail::unwritten<double>(f->outputs);
        detail::evaluate(*f, at, here.data());
        const std::vector<double> slope = detail::derivative_along(*f, at, std::move(along), here);
        std::copy(slope.begin(), slope.end(), out);
    };
    return d;
}

} // namespace filippov
