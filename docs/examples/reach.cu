// Counts how many random poses of a PUMA 560 end within half a metre of its base: the forward kinematics inside a kernel
// of one's own. On a machine with a GPU:
//
//     nvcc -fmad=false -I puma560/cuda reach.cu -o reach && ./reach
//
// Without one, the same function runs on the processor:
//
//     g++ -std=c++17 -x c++ -ffp-contract=off -I puma560/cuda reach.cu -o reach && ./reach
#include "puma560.cuh"

#include <cstdio>

#ifndef __CUDACC__
#define __host__
#define __device__
#endif

// Joint values from the number of a sample, uniform within a turn.
__host__ __device__ inline bool is_near(unsigned sample)
{
    double q[6];
    double T[16];
    for (int j = 0; j < 6; ++j) {
        sample = sample * 1664525U + 1013904223U;
        q[j] = sample * (6.283185307179586 / 4294967296.0);
    }
    puma560::cuda::fk(q, T);
    return T[3] * T[3] + T[7] * T[7] + T[11] * T[11] < 0.25;
}

constexpr unsigned samples = 1U << 20;

#ifdef __CUDACC__
__global__ void count(unsigned* found)
{
    for (unsigned i = blockIdx.x * blockDim.x + threadIdx.x; i < samples; i += gridDim.x * blockDim.x) {
        if (is_near(i)) {
            atomicAdd(found, 1U);
        }
    }
}
#endif

int main()
{
    unsigned found = 0;
#ifdef __CUDACC__
    unsigned* on_device = nullptr;
    cudaMalloc(&on_device, sizeof(unsigned));
    cudaMemset(on_device, 0, sizeof(unsigned));
    count<<<256, 128>>>(on_device);
    cudaMemcpy(&found, on_device, sizeof(unsigned), cudaMemcpyDeviceToHost);
    cudaFree(on_device);
#else
    for (unsigned i = 0; i < samples; ++i) {
        found += is_near(i) ? 1U : 0U;
    }
#endif
    std::printf("within 0.50 m: %.4f\n", static_cast<double>(found) / samples);
    return 0;
}
