; Two towers of three exchange their blocks.
(define (problem six-blocks-two-stacks)
  (:domain blocksworld)
  (:objects
    blue_block green_block pink_block purple_block red_block yellow_block - block
    arm - robot)
  (:init
    (handempty arm)
    (ontable red_block) (on green_block red_block) (on blue_block green_block) (clear blue_block)
    (ontable yellow_block) (on purple_block yellow_block) (on pink_block purple_block) (clear pink_block))
  (:goal (and
    (on purple_block red_block)
    (on blue_block purple_block)
    (on green_block yellow_block)
    (on pink_block green_block))))
