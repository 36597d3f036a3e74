// expect: return exactly Vec<S, dim>, not an Eigen expression
#include <filippov/engine/flow.hpp>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct EigenExpression {
    static constexpr int dim = 2;
    template <class S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(1)};
    }
    template <class S> auto f2(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return -x; }
    template <class S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
};

int main() {
    filippov::EventLog<double, 2, 1> log;
    return static_cast<int>(filippov::flow(EigenExpression{}, Vec<double, 0>(),
                                           Vec<double, 2>(0, 0), 0, 1,
                                           filippov::Settings<double, 2>{}, log)
                                .status);
}
