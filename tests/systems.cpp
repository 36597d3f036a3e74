// SPDX-License-Identifier: BSD-3-Clause
#include "systems.hpp"

#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/relay.hpp>
#include <filippov/orbits/any_system.hpp>

using namespace filippov;

namespace {

struct Bilinear {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> params{"delta", "omega"};
    static constexpr std::array<double, 2> defaults{0.1, 2};

    template <Scalar S> using P = Vec<S, 2>;
    template <Scalar S>
    static Vec<S, 2> pulled(const S& t, const Vec<S, 2>& x, const P<S>& p, const S& k) {
        using elementary::cos;
        return {x[1], cos(p[1] * t) - S(2) * p[0] * x[1] - k * x[0]};
    }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const P<S>& p) const {
        return pulled(t, x, p, S(1));
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const P<S>& p) const {
        return pulled(t, x, p, S(2));
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const P<S>&) const { return x[0]; }
    template <Scalar S> S period(const P<S>& p) const {
        return S(6.283185307179586476925286766559005768L) / p[1];
    }
};

} // namespace

std::shared_ptr<const AnySystem> oscillator_system(const Precision& precision) {
    return any_system(models::Oscillator{}, precision);
}
std::shared_ptr<const AnySystem> oscillator_system_5(const Precision& precision) {
    return any_system<DormandPrince5>(models::Oscillator{}, precision);
}
std::shared_ptr<const AnySystem> dieci_lopez_system(const Precision& precision) {
    return any_system(models::DieciLopez{}, precision);
}
std::shared_ptr<const AnySystem> relay_system(const Precision& precision) {
    return any_system(models::Relay{}, precision);
}
std::shared_ptr<const AnySystem> bilinear_system(const Precision& precision) {
    return any_system(Bilinear{}, precision);
}
