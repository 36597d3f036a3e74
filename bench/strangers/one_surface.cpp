// SPDX-License-Identifier: BSD-3-Clause
#include "one_surface.hpp"

#include "ask.hpp"

namespace filippov::strangers {

namespace {

/// A law in disguise: what the engine sees.
class Disguised {
public:
    static constexpr int dim = 3;
    template <class S> using X = Vec<S, 3>;
    template <class S> using None = Vec<S, 0>;

    Disguised(const OneSurface& law, const Disguise& disguise) : law_(&law), disguise_(&disguise) {}

    const Disguise& disguise() const { return *disguise_; }
    bool is_forced() const { return disguise_->period > 0; }
    template <class S> S period(const None<S>&) const { return S(disguise_->period); }
    template <Scalar S> X<S> f1(const S& t, const X<S>& x, const None<S>&) const {
        return side(t, x, -1);
    }
    template <Scalar S> X<S> f2(const S& t, const X<S>& x, const None<S>&) const {
        return side(t, x, 1);
    }
    template <Scalar S> S h(const S& t, const X<S>& x, const None<S>&) const {
        const X<S> z = disguise_->natural<S>(x);
        return S(disguise_->height[0]) * law_->h(S(S(disguise_->speed) * t), z.data());
    }
    bool has_sliding_flow() const {
        return law_->kind == OneSurface::relay && law_->relay_law.closed_form;
    }
    /// (of relays in straight coordinates, whose sliding field is constant)
    template <Scalar S>
    X<S> sliding_flow(const S&, const X<S>& x, const None<S>&, const S& dt) const {
        const RelayLaw& law = law_->relay_law;
        const double rate[] = {law.slope, law.relay.c0, law.c2};
        X<S> y = x;
        for (int i = 0; i < 3; ++i)
            y[i] = x[i] + S(rate[i] * disguise_->size[std::size_t(i)] * disguise_->speed) * dt;
        return y;
    }
    bool has_section() const { return law_->section_law.watched; }
    template <class S> S section(const S& t, const X<S>& x) const {
        const SectionLaw& law = law_->section_law;
        const X<S> z = disguise_->natural<S>(x);
        return S(disguise_->height[1]) *
               (law.wave(S(S(disguise_->speed) * t)) + S(law.k0) * z[0] + S(law.k1) * z[1]);
    }

private:
    template <class S> X<S> side(const S& t, const X<S>& x, int s) const {
        const X<S> z = disguise_->natural<S>(x);
        X<S> rate;
        law_->field(S(S(disguise_->speed) * t), z.data(), S(s), rate.data());
        return disguise_->rates<S>(z, rate);
    }

    const OneSurface* law_;
    const Disguise* disguise_;
};

} // namespace

Told ask_one_surface(const OneSurface& law, const Disguise& disguise, const Ask& ask) {
    return ask_engine(Disguised(law, disguise), ask);
}

} // namespace filippov::strangers
