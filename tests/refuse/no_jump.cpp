// expect: a surface of kind `jump` needs `template <class S> Vec<S, dim> jump(
#include <filippov/engine/flow.hpp>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct NoJump {
    static constexpr int dim = 2;
    static constexpr std::array kinds{filippov::SurfaceKind::jump};
    template <class S> Vec<S, 2> f(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(-1)};
    }
    template <class S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[0]; }
};

int main() { filippov::require_system<NoJump>(); }
