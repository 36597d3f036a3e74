// expect: filippov: `grad_h` is there and cannot be used: expected
#include <filippov/system/system.hpp>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct GradHWithoutSurface {
    static constexpr int dim = 2;
    static constexpr int surfaces = 2;
    template <class S>
    Vec<S, 2> field(const S&, const Vec<S, 2>&, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        return -s;
    }
    template <class S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return x;
    }
    template <class S> Vec<S, 2> grad_h(int j, const S&, const Vec<S, 2>&, const Vec<S, 0>&) const {
        return Vec<S, 2>::Unit(j);
    }
};

int main() { filippov::require_system<GradHWithoutSurface>(); }
