// expect: `h` must be a template over the scalar S, so that it can be differentiated
#include <filippov/engine/flow.hpp>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct HForDoubleOnly {
    static constexpr int dim = 2;
    template <class S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(1)};
    }
    template <class S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(-1)};
    }
    double h(const double&, const Vec<double, 2>& x, const Vec<double, 0>&) const { return x[1]; }
};

int main() {
    filippov::EventLog<double, 2, 1> log;
    return static_cast<int>(filippov::flow(HForDoubleOnly{}, Vec<double, 0>(), Vec<double, 2>(0, 0),
                                           0, 1, filippov::Settings<double, 2>{}, log)
                                .status);
}
