// expect: filippov: `s_max` is there and cannot be used: expected one switching surface
#include <filippov/system/system.hpp>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct SMaxOfTwoSurfaces {
    static constexpr int dim = 2;
    static constexpr int surfaces = 2;
    template <class S>
    Vec<S, 2> field(const S&, const Vec<S, 2>&, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        return -s;
    }
    template <class S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return x;
    }
    template <class S> S s_max(const Vec<S, 0>&) const { return S(1.5); }
};

int main() { filippov::require_system<SMaxOfTwoSurfaces>(); }
