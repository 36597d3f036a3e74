// SPDX-License-Identifier: BSD-3-Clause
#include "jumps.hpp"

#include "ask.hpp"

namespace filippov::strangers {

namespace {

/// A system with jumps in disguise: what the engine sees.
class Disguised {
public:
    static constexpr int dim = 4, surfaces = 2;
    static constexpr std::array kinds{SurfaceKind::jump, SurfaceKind::jump};
    template <class S> using X = Vec<S, 4>;
    template <class S> using None = Vec<S, 0>;

    Disguised(const Jumping& law, const Disguise& disguise) : law_(&law), disguise_(&disguise) {}

    const Disguise& disguise() const { return *disguise_; }
    bool is_forced() const { return disguise_->period > 0; }
    template <class S> S period(const None<S>&) const { return S(disguise_->period); }
    template <Scalar S> X<S> f(const S& t, const X<S>& x, const None<S>&) const {
        const X<S> z = disguise_->natural<S>(x);
        X<S> rate;
        if (law_->converts)
            law_->converter.field(z.data(), rate.data());
        else
            law_->bodies.field(natural_time(t), z.data(), rate.data());
        return disguise_->rates<S>(z, rate);
    }
    template <Scalar S> Vec<S, 2> h(const S& t, const X<S>& x, const None<S>&) const {
        const X<S> z = disguise_->natural<S>(x);
        Vec<S, 2> value;
        for (std::size_t j = 0; j < 2; ++j)
            value[int(j)] = S(disguise_->height[j]) *
                            (law_->converts ? law_->converter.h(j, z.data())
                                            : law_->bodies.h(j, natural_time(t), z.data()));
        return value;
    }
    template <Scalar S> X<S> jump(int j, const S& t, const X<S>& x, const None<S>&) const {
        X<S> z = disguise_->natural<S>(x);
        const auto at = std::size_t(j);
        if (law_->converts)
            law_->converter.jump(at, z.data());
        else
            law_->bodies.jump(at, rate_of(law_->bodies.bodies[at].floor, natural_time(t)),
                              z.data());
        return disguise_->disguised<S>(z);
    }
    bool has_section() const { return false; }
    template <class S> S section(const S&, const X<S>&) const { return S(1); }

private:
    template <class S> S natural_time(const S& t) const { return S(disguise_->speed) * t; }
    /// The derivative of a floor, by hand: it holds waves, a line and a constant.
    template <class S> static S rate_of(const Wave& floor, const S& t) {
        using elementary::sin;
        S rate(0);
        for (const Term& term : floor.terms)
            if (term.kind == Term::wave)
                rate = rate - S(term.c * term.p) * sin(S(term.p) * t + S(term.q));
            else if (term.p == 1)
                rate = rate + S(term.c);
        return rate;
    }

    const Jumping* law_;
    const Disguise* disguise_;
};

} // namespace

Told ask_jumping(const Jumping& law, const Disguise& disguise, const Ask& ask) {
    return ask_engine(Disguised(law, disguise), ask);
}

} // namespace filippov::strangers
