// SPDX-License-Identifier: BSD-3-Clause
#include "several.hpp"

#include "ask.hpp"

namespace filippov::strangers {

namespace {

/// Two relays in disguise: what the engine sees.
class Disguised {
public:
    static constexpr int dim = 3, surfaces = 2;
    template <class S> using X = Vec<S, 3>;
    template <class S> using None = Vec<S, 0>;

    Disguised(const TwoRelays& law, const Disguise& disguise) : law_(&law), disguise_(&disguise) {}

    const Disguise& disguise() const { return *disguise_; }
    bool is_forced() const { return disguise_->period > 0; }
    template <class S> S period(const None<S>&) const { return S(disguise_->period); }
    template <Scalar S>
    X<S> field(const S& t, const X<S>& x, const Vec<S, 2>& s, const None<S>&) const {
        const X<S> z = disguise_->natural<S>(x);
        X<S> rate;
        law_->field(S(S(disguise_->speed) * t), s.data(), rate.data());
        return disguise_->rates<S>(z, rate);
    }
    template <Scalar S> Vec<S, 2> h(const S& t, const X<S>& x, const None<S>&) const {
        const X<S> z = disguise_->natural<S>(x);
        Vec<S, 2> value;
        for (int j = 0; j < 2; ++j)
            value[j] = S(disguise_->height[std::size_t(j)]) *
                       law_->h(std::size_t(j), S(S(disguise_->speed) * t), z.data());
        return value;
    }
    bool has_section() const { return false; }
    template <class S> S section(const S&, const X<S>&) const { return S(1); }

private:
    const TwoRelays* law_;
    const Disguise* disguise_;
};

} // namespace

Told ask_several(const TwoRelays& law, const Disguise& disguise, const Ask& ask) {
    return ask_engine(Disguised(law, disguise), ask);
}

} // namespace filippov::strangers
