// expect: returning exactly S (Vec<S, surfaces> for several surfaces)
#include <filippov/engine/flow.hpp>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct HOfOneSurface {
    static constexpr int dim = 2;
    static constexpr int surfaces = 2;
    template <class S>
    Vec<S, 2> field(const S&, const Vec<S, 2>&, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        return {-s[0], -s[1]};
    }
    template <class S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[0]; }
};

int main() { filippov::require_system<HOfOneSurface>(); }
