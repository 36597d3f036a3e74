// expect: returning exactly S (Vec<S, surfaces> for several surfaces)
#include <filippov/engine/flow.hpp>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct HReturnsInt {
    static constexpr int dim = 2;
    template <class S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(1)};
    }
    template <class S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(-1)};
    }
    template <class S> int h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return x[1] > S(0) ? 1 : -1;
    }
};

int main() {
    filippov::EventLog<double, 2, 1> log;
    return static_cast<int>(filippov::flow(HReturnsInt{}, Vec<double, 0>(), Vec<double, 2>(0, 0), 0,
                                           1, filippov::Settings<double, 2>{}, log)
                                .status);
}
