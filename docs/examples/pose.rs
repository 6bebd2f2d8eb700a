use puma560::{fk, fk_batch, inverse, inverse_nearest, Branch, DOF, LIMITS};

fn main() {
    // One configuration: angles in rad, a 4x4 matrix row by row.
    let pose = fk(&[0.0, -0.3, 0.6, 0.0, 0.4, 0.0]);
    println!("position {:.4} {:.4} {:.4}", pose[0][3], pose[1][3], pose[2][3]);

    // Many configurations: slices in, slices out, no heap.
    let joints = [[0.1; DOF]; 1000];
    let mut poses = [[[0.0; 4]; 4]; 1000];
    fk_batch(&joints, &mut poses).expect("slices of the same length");
    println!("refused: {}", fk_batch(&joints[1..], &mut poses).unwrap_err());

    // All joint vectors of a pose, by the names of their branches, and the one nearest to a joint vector.
    let found = inverse(&pose);
    for (branch, q) in found.iter() {
        println!("{}: elbow {:.3}", branch.name(), q[2]);
    }
    println!("{:?}", found.get(Branch::ShoulderRightElbowUpWristFlip));
    println!("{}", inverse_nearest(&pose, &[0.0; DOF]).is_some());
    println!("limits of joint 1 {:?}", LIMITS[0]);
}
