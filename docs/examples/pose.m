% One configuration: a column of angles in rad. The pose is a 4x4 matrix.
T = puma560.fk([0; -0.3; 0.6; 0; 0.4; 0]);
printf('position %s\n', sprintf(' %.4f', T(1:3, 4)));

% Many configurations: one in each column of q, and one in each page of the result.
poses = puma560.fk(zeros(6, 1000));
printf('poses %s\n', mat2str(size(poses)));

% All joint vectors of a pose, and the one nearest to another joint vector.
[solutions, valid] = puma560.inverse(T);
printf('solutions %d of %d\n', sum(valid), numel(valid));
q = puma560.inverse_nearest(T, zeros(6, 1));
printf('nearest %s\n', sprintf(' %.3f', q));

% Singles give singles.
printf('%s\n', class(puma560.fk(single(q))));
about = puma560.info();
printf('limits of joint 1 %s\n', sprintf(' %.4f', about.LIMITS(1, :)));
try
  puma560.fk([1, 2, 3]);
catch problem
  disp(problem.message);
end
